//! Reader of Biovision Hierarchy motion: a skeleton and a table of channel values.
//!
//! Written here because the crates that read it are no longer maintained. Channels come in any order, joints may carry
//! position channels, names may contain blanks; every error names the line, what was found and what was expected.

use std::path::{Path, PathBuf};

use nalgebra::{UnitQuaternion, Vector3};

use crate::{
    data,
    error::{Error, Result},
};

/// What a column of the table does to its joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Along axis 0, 1, 2; replaces that component of the offset.
    Position(usize),
    /// About axis 0, 1, 2, degrees; rotations multiply in the order of the channels.
    Rotation(usize),
}

/// A joint of the hierarchy, with its columns of the motion table.
#[derive(Clone, Debug, PartialEq)]
pub struct BvhJoint {
    pub name: String,
    /// Always before this joint; the root has none.
    pub parent: Option<usize>,
    /// From the parent at rest, in the file's unit.
    pub offset: [f64; 3],
    pub channels: Vec<Channel>,
    /// Of an `End Site` below this joint.
    pub end_offset: Option<[f64; 3]>,
}

/// A whole file: `frames` is `[frame][column]`, the columns in the order of the joints and of their channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Bvh {
    /// For messages; empty if it was no file.
    pub source: PathBuf,
    pub joints: Vec<BvhJoint>,
    pub frame_time_s: f64,
    /// The frame time as it was written is rounded to this, seconds.
    pub frame_time_step_s: f64,
    pub frames: Vec<Vec<f64>>,
}

/// Where the joints are in one frame, in the file's axes and unit.
pub struct BvhPose {
    /// `[joint]`: rotation from the joint's axes to the file's.
    pub turns: Vec<UnitQuaternion<f64>>,
    /// `[joint]`.
    pub places: Vec<Vector3<f64>>,
}

impl Bvh {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read, or is no BVH: with the line, what was found and what was expected.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = data::files::read(path)?;
        // Names in old files are not always UTF-8.
        let bvh = Self::parse(&String::from_utf8_lossy(&bytes)).map_err(|message| Error::Parse { path: path.into(), message })?;
        Ok(Self { source: path.into(), ..bvh })
    }

    /// Reads the text of a file; the error is a message with the line.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        let mut lines = Lines::new(text);
        let joints = hierarchy(&mut lines)?;
        let ((frame_time_s, frame_time_step_s), frames) = table(&mut lines, &joints)?;
        Ok(Self { source: PathBuf::new(), joints, frame_time_s, frame_time_step_s, frames })
    }

    /// Index of the first joint of this name.
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// Forward kinematics of one frame.
    pub fn pose(&self, frame: usize) -> BvhPose {
        let mut values = self.frames[frame].iter();
        let mut pose = BvhPose { turns: Vec::new(), places: Vec::new() };
        for joint in &self.joints {
            let (mut turn, mut offset) = (UnitQuaternion::identity(), Vector3::from(joint.offset));
            for (channel, &value) in joint.channels.iter().zip(&mut values) {
                match *channel {
                    Channel::Position(axis) => offset[axis] = value,
                    Channel::Rotation(axis) => {
                        let mut vector = Vector3::zeros();
                        vector[axis] = value.to_radians();
                        turn *= UnitQuaternion::new(vector);
                    }
                }
            }
            let (turn, place) = match joint.parent {
                Some(parent) => (pose.turns[parent] * turn, pose.places[parent] + pose.turns[parent] * offset),
                None => (turn, offset),
            };
            pose.turns.push(turn);
            pose.places.push(place);
        }
        pose
    }

    /// The joints with all rotations zero and the root at the origin.
    pub fn rest(&self) -> Vec<Vector3<f64>> {
        let mut places: Vec<Vector3<f64>> = Vec::new();
        for joint in &self.joints {
            places.push(joint.parent.map_or(Vector3::zeros(), |parent| places[parent] + Vector3::from(joint.offset)));
        }
        places
    }
}

/// Lines that are not empty, with their numbers from 1.
struct Lines<'a> {
    lines: std::iter::Peekable<std::vec::IntoIter<(usize, &'a str)>>,
    last: usize,
}

impl<'a> Lines<'a> {
    fn new(text: &'a str) -> Self {
        let trimmed = text.trim_start_matches('\u{feff}').lines().enumerate().map(|(number, line)| (number + 1, line.trim()));
        let lines: Vec<(usize, &str)> = trimmed.filter(|(_, line)| !line.is_empty()).collect();
        Self { lines: lines.into_iter().peekable(), last: text.lines().count() }
    }

    fn next(&mut self, expected: &str) -> std::result::Result<(usize, &'a str), String> {
        self.lines.next().ok_or_else(|| format!("line {}: the file ends, expected {expected}", self.last))
    }

    /// The rest of the next line, which must start with this word.
    fn after(&mut self, word: &str) -> std::result::Result<(usize, &'a str), String> {
        let (number, line) = self.next(&format!("`{word}`"))?;
        match line.strip_prefix(word) {
            Some(rest) => Ok((number, rest.trim())),
            None => Err(format!("line {number}: found `{}`, expected `{word}`", shortened(line))),
        }
    }

    /// An opening brace, on its own line or at the end of the line before.
    fn open(&mut self, line: &'a str) -> std::result::Result<&'a str, String> {
        match line.strip_suffix('{') {
            Some(name) => Ok(name.trim()),
            None => self.after("{").map(|_| line),
        }
    }
}

fn shortened(line: &str) -> String {
    if line.chars().count() > 40 { format!("{}…", line.chars().take(40).collect::<String>()) } else { line.to_string() }
}

fn numbers(number: usize, text: &str) -> std::result::Result<Vec<f64>, String> {
    let parse = |(column, word): (usize, &str)| match word.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("line {number}: value {} is `{}`, expected a finite number", column + 1, shortened(word))),
    };
    text.split_whitespace().enumerate().map(parse).collect()
}

fn offset(lines: &mut Lines) -> std::result::Result<[f64; 3], String> {
    let (number, text) = lines.after("OFFSET")?;
    let values = numbers(number, text)?;
    <[f64; 3]>::try_from(values).map_err(|values| format!("line {number}: OFFSET has {} values, expected 3", values.len()))
}

fn channels(lines: &mut Lines) -> std::result::Result<Vec<Channel>, String> {
    let (number, text) = lines.after("CHANNELS")?;
    let mut words = text.split_whitespace();
    let count = words.next().unwrap_or_default();
    let channels: Vec<Channel> = words
        .map(|word| {
            let axis = "XYZ".find(word.chars().next().unwrap_or(' ').to_ascii_uppercase());
            match (axis, word.get(1..).map(str::to_ascii_lowercase).as_deref()) {
                (Some(axis), Some("position")) => Ok(Channel::Position(axis)),
                (Some(axis), Some("rotation")) => Ok(Channel::Rotation(axis)),
                _ => Err(format!(
                    "line {number}: found channel `{}`, expected such as `Xposition` or `Zrotation`",
                    shortened(word)
                )),
            }
        })
        .collect::<std::result::Result<_, _>>()?;
    if count.parse() != Ok(channels.len()) {
        return Err(format!("line {number}: CHANNELS says `{count}`, but {} names follow", channels.len()));
    }
    Ok(channels)
}

fn hierarchy(lines: &mut Lines) -> std::result::Result<Vec<BvhJoint>, String> {
    lines.after("HIERARCHY")?;
    let mut joints: Vec<BvhJoint> = Vec::new();
    let mut open: Vec<usize> = Vec::new();
    loop {
        let expected = if open.is_empty() { "`ROOT`" } else { "`JOINT`, `End Site` or `}`" };
        let (number, line) = lines.next(expected)?;
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        match (word, open.is_empty()) {
            ("ROOT", true) | ("JOINT", false) => {
                let name = lines.open(rest.trim())?.to_string();
                if name.is_empty() {
                    return Err(format!("line {number}: {word} without a name"));
                }
                if joints.iter().any(|joint| joint.name == name) {
                    return Err(format!("line {number}: there are two joints named `{name}`"));
                }
                let (offset, channels) = (offset(lines)?, channels(lines)?);
                joints.push(BvhJoint { name, parent: open.last().copied(), offset, channels, end_offset: None });
                open.push(joints.len() - 1);
            }
            ("End", false) => {
                lines.open(rest.trim())?;
                let end = offset(lines)?;
                open.last().into_iter().for_each(|&joint| joints[joint].end_offset = Some(end));
                lines.after("}")?;
            }
            ("}", false) => {
                open.pop();
                if open.is_empty() {
                    return Ok(joints);
                }
            }
            _ => return Err(format!("line {number}: found `{}`, expected {expected}", shortened(line))),
        }
    }
}

/// The frame time and its rounding, and the frames.
type Frames = ((f64, f64), Vec<Vec<f64>>);

/// What a decimal number was rounded to when it was written: one in its last digit.
fn last_digit(text: &str) -> f64 {
    let (digits, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    let decimals = digits.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    10_f64.powi(exponent.parse::<i32>().unwrap_or(0).saturating_sub(decimals.min(99) as i32))
}

fn table(lines: &mut Lines, joints: &[BvhJoint]) -> std::result::Result<Frames, String> {
    let (number, rest) = lines.after("MOTION")?;
    if !rest.is_empty() {
        return Err(format!("line {number}: found `{}` after `MOTION`, expected a new line", shortened(rest)));
    }
    let (number, text) = lines.after("Frames:")?;
    let count: usize =
        text.parse().map_err(|_| format!("line {number}: `Frames:` is `{}`, expected a whole number", shortened(text)))?;
    if count == 0 {
        return Err(format!("line {number}: `Frames:` is 0, expected at least one frame"));
    }
    let (number, text) = lines.after("Frame Time:")?;
    let frame_time_s = match text.parse::<f64>() {
        Ok(time) if time.is_finite() && time > 0.0 => (time, last_digit(text)),
        _ => return Err(format!("line {number}: `Frame Time:` is `{}`, expected seconds above zero", shortened(text))),
    };

    let columns: Vec<(&str, Channel)> =
        joints.iter().flat_map(|joint| joint.channels.iter().map(|&channel| (joint.name.as_str(), channel))).collect();
    let mut frames = Vec::new();
    for (number, line) in lines.lines.by_ref() {
        if frames.len() == count {
            return Err(format!("line {number}: `Frames:` says {count}, but more lines follow"));
        }
        let values = numbers(number, line).map_err(|message| {
            let column = line.split_whitespace().position(|word| !word.parse::<f64>().is_ok_and(f64::is_finite));
            let joint = column.and_then(|column| columns.get(column)).map_or("", |column| column.0);
            if joint.is_empty() { message } else { format!("{message} for joint `{joint}`") }
        })?;
        if values.len() != columns.len() {
            return Err(format!("line {number}: found {} values, expected {} (one per channel)", values.len(), columns.len()));
        }
        frames.push(values);
    }
    if frames.len() < count {
        return Err(format!("line {}: the file ends after {} frames, `Frames:` says {count}", lines.last, frames.len()));
    }
    Ok((frame_time_s, frames))
}

#[cfg(test)]
#[path = "bvh_tests.rs"]
mod tests;
