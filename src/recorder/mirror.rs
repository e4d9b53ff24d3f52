//! Image theory in a box room: walls as mirrors, and which of them a path may use.

use super::vector::Vector;
use crate::room::{Boundary, Room};

/// Reflection in none, one or two walls: along each axis x → sign · x + offset.
#[derive(Clone, Debug, PartialEq)]
pub struct Mirror {
    sign: Vector,
    offset_m: Vector,
    /// In the order in which a wave from the antenna meets them.
    pub walls: Vec<Boundary>,
}

impl Mirror {
    /// No wall at all.
    pub fn none() -> Self {
        Self { sign: [1.0; 3], offset_m: [0.0; 3], walls: vec![] }
    }

    /// The image of what `self` shows, in one more wall.
    fn then(&self, wall: Boundary, distance_m: f64) -> Self {
        let (axis, side) = wall.axis();
        let mut next = self.clone();
        next.sign[axis] = -next.sign[axis];
        next.offset_m[axis] = 2.0 * side * distance_m - next.offset_m[axis];
        next.walls.push(wall);
        next
    }

    /// Images of up to `order` walls (0, 1 or 2), the direct view first.
    ///
    /// In a box room two facing walls give two images of the second order, one for either sequence. Two walls that
    /// meet in a corner give one image, and a given ray can follow only one of its sequences, so it is listed once.
    pub fn images(room: &Room, walls: &[Boundary], order: usize) -> Vec<Self> {
        let known: Vec<_> = walls.iter().filter_map(|&wall| Some((wall, room.distance_m(wall)?))).collect();
        let mut images = vec![Self::none()];
        if order >= 1 {
            images.extend(known.iter().map(|&(wall, distance)| Self::none().then(wall, distance)));
        }
        if order >= 2 {
            for (i, &(first, near)) in known.iter().enumerate() {
                for (j, &(second, far)) in known.iter().enumerate() {
                    if i != j && (first.axis().0 == second.axis().0 || i < j) {
                        images.push(Self::none().then(first, near).then(second, far));
                    }
                }
            }
        }
        images
    }

    /// How many walls the wave meets.
    pub fn order(&self) -> usize {
        self.walls.len()
    }

    /// Image of a point.
    pub fn point(&self, position_m: Vector) -> Vector {
        std::array::from_fn(|axis| self.sign[axis] * position_m[axis] + self.offset_m[axis])
    }

    /// A direction seen from the image, as it leaves the true antenna.
    pub fn direction(&self, direction: Vector) -> Vector {
        std::array::from_fn(|axis| self.sign[axis] * direction[axis])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recorder::vector::{add, distance, scale, subtract};

    fn room() -> Room {
        Room { left_m: Some(2.0), right_m: Some(1.5), front_m: Some(5.0), floor_m: Some(1.0), ..Room::default() }
    }

    #[test]
    fn the_image_path_is_as_long_as_the_path_over_the_wall() {
        let (antenna, point) = ([0.1, 0.0, 0.2], [-0.7, 3.0, -0.3]);
        let images = Mirror::images(&room(), &[Boundary::Left], 1);
        let image = images[1].point(antenna);
        // Where the unrolled ray crosses the wall is where the true ray is reflected.
        let fraction = (-2.0 - image[0]) / (point[0] - image[0]);
        let bounce = add(image, scale(subtract(point, image), fraction));
        let explicit = distance(antenna, bounce) + distance(bounce, point);
        assert!((distance(image, point) - explicit).abs() < 1e-12);
        // The law of reflection at that point: the shortest detour over the wall.
        for (dy, dz) in [(1e-3, 0.0), (-1e-3, 0.0), (0.0, 1e-3), (0.0, -1e-3)] {
            let other = add(bounce, [0.0, dy, dz]);
            assert!(distance(antenna, other) + distance(other, point) > explicit);
        }
    }

    #[test]
    fn four_walls_with_one_facing_pair_have_seven_images_of_the_second_order() {
        let all = Mirror::images(&room(), &Boundary::ALL, 2);
        assert_eq!(all.iter().filter(|mirror| mirror.order() == 1).count(), 4);
        assert_eq!(all.iter().filter(|mirror| mirror.order() == 2).count(), 7);
        for (i, a) in all.iter().enumerate() {
            for b in &all[..i] {
                assert!(distance(a.point([0.1, 0.2, 0.3]), b.point([0.1, 0.2, 0.3])) > 0.1, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn facing_walls_move_the_image_by_twice_their_distance() {
        let all = Mirror::images(&room(), &[Boundary::Left, Boundary::Right], 2);
        let mut shifts: Vec<f64> =
            all.iter().filter(|mirror| mirror.order() == 2).map(|mirror| mirror.point([0.0; 3])[0]).collect();
        shifts.sort_by(f64::total_cmp);
        assert_eq!(shifts, vec![-7.0, 7.0]);
    }
}
