//! The room as scatterers: a grid of flat patches on every boundary, and the proxy receivers of the indirect path.

use serde::{Deserialize, Serialize};

use crate::bounds;
use crate::error::{Error, Result};
use crate::room::{Boundary, Room};

/// Settings of the room's patches and proxies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RoomPatchesConfig {
    /// Distance between neighbouring patches, metres. 0.15 gives about 5,000 patches in an ordinary room, as many as
    /// mmMesh's public code has.
    pub patch_spacing_m: f64,
    /// The number of patches to aim for instead; it then chooses the spacing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub patches: Option<usize>,
    /// How far boundaries reach towards a side where there is no boundary, metres from the reference point.
    pub open_m: f64,
    /// Virtual receivers on every boundary, on a grid; one sits in the boundary's centre.
    pub proxies_per_boundary: usize,
}

impl Default for RoomPatchesConfig {
    fn default() -> Self {
        Self { patch_spacing_m: 0.15, patches: None, open_m: 4.0, proxies_per_boundary: 1 }
    }
}

/// The static scatterers; all lists are `[point]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RoomPatches {
    /// Metres, radar frame.
    pub position_m: Vec<[f64; 3]>,
    /// Unit, into the room.
    pub normal: Vec<[f64; 3]>,
    pub area_m2: Vec<f64>,
    pub boundary: Vec<Boundary>,
    /// Position as −1 … 1 between the room's opposite sides: what the periodic encoding takes.
    pub normalised: Vec<[f64; 3]>,
}

/// A virtual receiver on a boundary (x_w,k in the paper's section 3.3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proxy {
    pub boundary: Boundary,
    /// Metres, radar frame.
    pub position_m: [f64; 3],
    /// Unit, into the room.
    pub normal: [f64; 3],
}

/// More patches than this cannot be meant.
const MOST_PATCHES: f64 = 5e6;

/// Each proxy costs a sum over all points: a thousand of them a thousand times the paper's one.
const MOST_PROXIES: usize = 1000;

impl RoomPatchesConfig {
    /// Refuses what cannot work. `key` names these settings in messages.
    pub fn check(&self, key: &str) -> Result<()> {
        for (name, value) in [("patch_spacing_m", self.patch_spacing_m), ("open_m", self.open_m)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::setting(format!("{key}.{name}"), value, "a length above zero in metres"));
            }
        }
        if let Some(patches) = self.patches {
            bounds::count(format!("{key}.patches"), patches, MOST_PATCHES as usize)
                .map_err(|error| error.with_hint("leave the room out for no room"))?;
        }
        bounds::count(format!("{key}.proxies_per_boundary"), self.proxies_per_boundary, MOST_PROXIES)
            .map_err(|error| error.with_hint("switch the indirect path off for none"))
    }

    /// The spacing in use, metres.
    pub fn spacing_m(&self, room: &Room) -> f64 {
        match self.patches {
            None => self.patch_spacing_m,
            Some(patches) => {
                let area: f64 = room.boundaries().iter().map(|&boundary| Side::new(room, boundary, self.open_m).area_m2()).sum();
                (area / patches as f64).sqrt().max(1e-6)
            }
        }
    }

    /// The patches: on every boundary a grid of equal cells close to the spacing, with a patch in each cell's centre.
    pub fn init(&self, room: &Room) -> Result<RoomPatches> {
        self.check("room")?;
        let spacing = self.spacing_m(room);
        let sides: Vec<Side> = room.boundaries().into_iter().map(|boundary| Side::new(room, boundary, self.open_m)).collect();
        let count: f64 = sides.iter().map(|side| side.area_m2() / (spacing * spacing)).sum();
        if count > MOST_PATCHES {
            return Err(Error::setting(
                "room.patch_spacing_m",
                spacing,
                format!("a spacing that leaves at most {MOST_PATCHES} patches"),
            ));
        }
        let (low, high) = room.extent_m(self.open_m);
        let mut patches = RoomPatches::default();
        for side in sides {
            let counts = side.size_m().map(|size| ((size / spacing).round() as usize).max(1));
            let cells = side.cells(counts);
            let area = side.area_m2() / cells.len() as f64;
            for position in cells {
                patches.position_m.push(position);
                patches.normal.push(side.boundary.normal());
                patches.area_m2.push(area);
                patches.boundary.push(side.boundary);
                patches
                    .normalised
                    .push(std::array::from_fn(|axis| 2.0 * (position[axis] - low[axis]) / (high[axis] - low[axis]) - 1.0));
            }
        }
        Ok(patches)
    }

    /// The proxy receivers, boundary by boundary in the order of `Boundary::ALL`.
    pub fn proxies(&self, room: &Room) -> Vec<Proxy> {
        proxies(room, self.proxies_per_boundary, self.open_m)
    }
}

/// `count` virtual receivers on each boundary: its centre, or the centres of a grid of `count` cells as square as can be.
///
/// The centre rather than the foot of the radar's perpendicular: on floor and side walls that foot lies next to the
/// radar, where it sees the person at grazing angles only, while mirror points lie between the two.
pub fn proxies(room: &Room, count: usize, open_m: f64) -> Vec<Proxy> {
    let on = |boundary: Boundary| {
        let side = Side::new(room, boundary, open_m);
        side.cells(squarest(count, side.size_m())).into_iter().map(move |position_m| Proxy {
            boundary,
            position_m,
            normal: boundary.normal(),
        })
    };
    room.boundaries().into_iter().flat_map(on).collect()
}

/// The factors of `count` that cut a rectangle into the squarest cells.
fn squarest(count: usize, size_m: [f64; 2]) -> [usize; 2] {
    let stretch = |columns: usize| {
        let rows = count / columns;
        ((size_m[0] / columns as f64) / (size_m[1] / rows as f64)).ln().abs()
    };
    let columns = (1..=count)
        .filter(|columns| count.is_multiple_of(*columns))
        .min_by(|&a, &b| stretch(a).total_cmp(&stretch(b)))
        .unwrap_or(1);
    [columns, count / columns]
}

/// One boundary as a rectangle.
struct Side {
    boundary: Boundary,
    low: [f64; 3],
    high: [f64; 3],
    /// The two axes that span it.
    axes: [usize; 2],
}

impl Side {
    fn new(room: &Room, boundary: Boundary, open_m: f64) -> Self {
        let (low, high) = room.extent_m(open_m);
        let (axis, _) = boundary.axis();
        Self { boundary, low, high, axes: [(axis + 1) % 3, (axis + 2) % 3] }
    }

    fn size_m(&self) -> [f64; 2] {
        self.axes.map(|axis| self.high[axis] - self.low[axis])
    }

    fn area_m2(&self) -> f64 {
        let [a, b] = self.size_m();
        a * b
    }

    /// Centres of a grid of cells.
    fn cells(&self, counts: [usize; 2]) -> Vec<[f64; 3]> {
        let (axis, sign) = self.boundary.axis();
        let level = if sign > 0.0 { self.high[axis] } else { self.low[axis] };
        let along = |which: usize, cell: usize| {
            let axis = self.axes[which];
            self.low[axis] + (self.high[axis] - self.low[axis]) * (cell as f64 + 0.5) / counts[which] as f64
        };
        (0..counts[0])
            .flat_map(|first| (0..counts[1]).map(move |second| (first, second)))
            .map(|(first, second)| {
                let mut position = [level; 3];
                position[self.axes[0]] = along(0, first);
                position[self.axes[1]] = along(1, second);
                position
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn room() -> Room {
        Room {
            left_m: Some(1.9),
            right_m: Some(2.4),
            front_m: Some(5.6),
            back_m: Some(0.6),
            floor_m: Some(1.0),
            ceiling_m: Some(1.7),
        }
    }

    #[test]
    fn patches_lie_on_their_boundary_look_inwards_and_cover_it() {
        let patches = RoomPatchesConfig::default().init(&room()).unwrap();
        for (index, position) in patches.position_m.iter().enumerate() {
            let boundary = patches.boundary[index];
            let (axis, sign) = boundary.axis();
            assert_eq!(position[axis], sign * room().distance_m(boundary).unwrap());
            let inwards: f64 = (0..3).map(|i| -position[i] * patches.normal[index][i]).sum();
            assert!(inwards > 0.0, "the radar is on the inner side of {boundary:?}");
            assert!((patches.normalised[index][axis] - sign).abs() < 1e-12);
            assert!(patches.normalised[index].iter().all(|x| x.abs() <= 1.0 + 1e-12));
        }
        let whole = 2.0 * (4.3 * 6.2 + 4.3 * 2.7 + 6.2 * 2.7);
        assert!((patches.area_m2.iter().sum::<f64>() - whole).abs() < 1e-9);
    }

    #[test]
    fn the_number_of_patches_can_be_asked_for() {
        for wanted in [500, 5000] {
            let config = RoomPatchesConfig { patches: Some(wanted), ..Default::default() };
            let found = config.init(&room()).unwrap().position_m.len() as f64;
            assert!((found / wanted as f64 - 1.0).abs() < 0.05, "{found} for {wanted}");
        }
        let default = RoomPatchesConfig::default().init(&room()).unwrap().position_m.len();
        let sides = room().boundaries().into_iter().map(|boundary| Side::new(&room(), boundary, 4.0).area_m2());
        let wanted = sides.sum::<f64>() / 0.15f64.powi(2);
        assert!((default as f64 / wanted - 1.0).abs() < 0.05, "{default} for {wanted}");
    }

    #[test]
    fn an_open_side_has_no_patches_and_ends_its_neighbours() {
        let open = Room { ceiling_m: None, front_m: None, ..room() };
        let patches = RoomPatchesConfig { open_m: 3.0, ..Default::default() }.init(&open).unwrap();
        assert!(!patches.boundary.contains(&Boundary::Ceiling) && patches.boundary.contains(&Boundary::Floor));
        let farthest = patches.position_m.iter().map(|position| position[1]).fold(0.0, f64::max);
        assert!(farthest < 3.0 && farthest > 2.8);
        assert_eq!(RoomPatchesConfig::default().init(&Room::default()).unwrap(), RoomPatches::default());
    }

    #[test]
    fn proxies_sit_in_the_centre_or_on_a_grid() {
        let one = proxies(&room(), 1, 4.0);
        assert_eq!(one.len(), 6);
        let left = one.iter().find(|proxy| proxy.boundary == Boundary::Left).unwrap();
        assert!((0..3).all(|axis| (left.position_m[axis] - [-1.9, 2.5, 0.35][axis]).abs() < 1e-12), "{left:?}");
        assert_eq!(left.normal, [1.0, 0.0, 0.0]);
        let six = proxies(&room(), 6, 4.0);
        assert_eq!(six.len(), 36);
        assert_eq!(squarest(6, [6.2, 2.7]), [3, 2]);
        assert_eq!(squarest(6, [2.7, 6.2]), [2, 3]);
        assert_eq!(squarest(7, [1.0, 1.0]).iter().product::<usize>(), 7);
    }

    #[test]
    fn settings_that_cannot_work_are_named() {
        let refused = |config: RoomPatchesConfig| config.init(&room()).unwrap_err().to_string();
        assert!(
            refused(RoomPatchesConfig { patch_spacing_m: 0.0, ..Default::default() }).starts_with("`room.patch_spacing_m` is 0")
        );
        assert!(refused(RoomPatchesConfig { patch_spacing_m: 1e-4, ..Default::default() }).contains("at most"));
        assert!(refused(RoomPatchesConfig { proxies_per_boundary: 0, ..Default::default() }).contains("proxies_per_boundary"));
        assert!(toml::from_str::<RoomPatchesConfig>("patch_spacing = 0.1").is_err());
    }
}
