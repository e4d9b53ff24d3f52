//! Damages recordings as captures are damaged in practice.
#![allow(dead_code)]

use std::path::Path;

use hybridsim::data::{IfFrame, IfLayout, Recording, RecordingContents, write_recording};

/// 16-bit words in a packet of 1456 bytes, the payload that boards of one common kind send.
pub const PACKET: usize = 728;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Damage {
    None,
    /// I I Q Q read as I Q I Q.
    WordOrder,
    /// So many packets are zeros.
    ZeroPackets(usize),
    /// A packet in the middle is missing, the rest comes earlier.
    LostPacket,
    /// The second half of every frame is zero.
    HalfFrames,
    /// Chirps in the order of firing fill the tx axis.
    Unseparated,
    /// One transmitter is stated where several fired in turn.
    OneTransmitter,
    /// This frame is the one before it.
    RepeatedFrame(usize),
    /// The second half of this frame's loops is its first half.
    RepeatedLoops(usize),
    /// From so many samples on, these loops of receiver 0 hold the last value.
    Stuck {
        frame: usize,
        loops: usize,
    },
}

/// Words of I and Q, `[frame, loop, tx, rx, sample, iq]`: as they were taken.
struct Words {
    /// `[frame, tx, rx, loop, sample]`
    dims: [usize; 5],
    words: Vec<f32>,
}

impl Words {
    fn of(recording: &Recording) -> Self {
        let dims @ [frames, tx, rx, loops, samples] = recording.radar.dims();
        let mut words = vec![];
        for frame in 0..frames {
            let frame = recording.frame(frame).unwrap();
            for (index, channel) in (0..loops).flat_map(|index| (0..tx * rx).map(move |channel| (index, channel))) {
                for sample in 0..samples {
                    let value = frame.sample(channel / rx, channel % rx, index, sample);
                    words.extend([value.re, value.im]);
                }
            }
        }
        Self { dims, words }
    }

    /// Words of one loop.
    fn period(&self) -> usize {
        let [_, tx, rx, _, samples] = self.dims;
        2 * tx * rx * samples
    }

    fn frame_length(&self) -> usize {
        self.dims[3] * self.period()
    }

    fn frame(&self, frame: usize) -> IfFrame {
        let [_, tx, rx, loops, samples] = self.dims;
        let own = &self.words[frame * self.frame_length()..][..self.frame_length()];
        let (mut re, mut im) = (vec![], vec![]);
        for (channel, index) in (0..tx * rx).flat_map(|channel| (0..loops).map(move |index| (channel, index))) {
            for pair in own[(index * tx * rx + channel) * 2 * samples..][..2 * samples].chunks_exact(2) {
                re.push(pair[0]);
                im.push(pair[1]);
            }
        }
        IfFrame::new([tx, rx, loops, samples], re, Some(im))
    }

    /// From I Q I Q to the board's I I Q Q, and back.
    fn exchange(&mut self) {
        self.words.chunks_exact_mut(4).for_each(|four| four.swap(1, 2));
    }

    fn damage(&mut self, damage: Damage) {
        let (length, half) = (self.frame_length(), self.frame_length() / 2);
        let [_, tx, rx, loops, samples] = self.dims;
        match damage {
            Damage::None | Damage::OneTransmitter => {}
            Damage::WordOrder => self.exchange(),
            Damage::ZeroPackets(count) => {
                self.exchange();
                let packets = self.words.len() / PACKET;
                // Apart from each other, and not in step with frames.
                for packet in (0..count).map(|i| (i * packets / count + 7 * i + 3) % packets) {
                    self.words[packet * PACKET..(packet + 1) * PACKET].fill(0.0);
                }
                self.exchange();
            }
            Damage::LostPacket => {
                self.exchange();
                let middle = self.words.len() / PACKET / 2 * PACKET;
                self.words.drain(middle..middle + PACKET);
                self.words.extend([0.0; PACKET]);
                self.exchange();
            }
            Damage::HalfFrames => self.words.chunks_exact_mut(length).for_each(|frame| frame[half..].fill(0.0)),
            Damage::Unseparated => {
                let chirp = 2 * rx * samples;
                for frame in self.words.chunks_exact_mut(length) {
                    let fired = frame.to_vec();
                    for (position, chirps) in fired.chunks_exact(chirp).enumerate() {
                        let (of, index) = (position / loops, position % loops);
                        frame[(index * tx + of) * chirp..][..chirp].copy_from_slice(chirps);
                    }
                }
            }
            Damage::RepeatedFrame(frame) => self.words.copy_within((frame - 1) * length..frame * length, frame * length),
            Damage::RepeatedLoops(frame) => {
                let start = frame * length;
                self.words.copy_within(start..start + half, start + half);
            }
            Damage::Stuck { frame, loops } => {
                let period = self.period();
                for index in 0..loops {
                    let chirp = &mut self.words[frame * length + index * period..][..2 * samples];
                    let (i, q) = (chirp[samples - 2], chirp[samples - 1]);
                    chirp[samples..].chunks_exact_mut(2).for_each(|pair| pair.copy_from_slice(&[i, q]));
                }
            }
        }
    }
}

/// A damaged copy of a recording.
pub fn damaged(from: &Path, to: &Path, damage: Damage) {
    let recording = Recording::open(from).unwrap();
    let mut words = Words::of(&recording);
    words.damage(damage);
    let mut radar = recording.radar.clone();
    if damage == Damage::OneTransmitter {
        radar.loops_per_frame *= radar.tx_m.len();
        radar.tx_m.truncate(1);
        words.dims = radar.dims();
    }
    let contents = RecordingContents {
        radar: &radar,
        room: recording.room.as_ref(),
        person: recording.person(),
        body_file: None,
        labels: recording.labels.clone(),
        layout: IfLayout::Codes,
        truth: None,
    };
    write_recording(to, &contents, &mut |index| Ok(words.frame(index))).unwrap();
}
