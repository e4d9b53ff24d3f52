//! Files of a DCA1000's packets with their headers, as a program that only receives them leaves them.
//!
//! A packet is a header and up to 1456 bytes of samples; the header begins with the packet's number, a little-endian 32-bit integer (TI,
//! "DCA1000EVM Data Capture Card User's Guide", SPRUIJ4, section on raw mode: number and byte count, 4 and 6 bytes). mmWave Studio puts a
//! packet's length between them in the files that its own reordering reads (14 bytes).

use std::io::Read;
use std::path::Path;

use crate::data::files;
use crate::error::{Error, Result};

/// Bytes of the samples of a whole packet.
const PAYLOAD: usize = 1456;
/// Bytes of a header.
const HEADERS: [usize; 2] = [10, 14];
/// Packets that are looked at.
const LOOKED_AT: usize = 64;
/// Steps by one that make numbers of packets: words of samples make one with a chance of 2⁻³².
const FEWEST: usize = 2;

/// Bytes of the header of each packet, if there are any.
fn header(bytes: &[u8]) -> Option<usize> {
    HEADERS.into_iter().find(|header| {
        let starts = bytes.chunks(header + PAYLOAD).filter_map(|packet| packet.first_chunk::<4>());
        let numbers: Vec<u32> = starts.map(|start| u32::from_le_bytes(*start)).collect();
        let next = numbers.windows(2).filter(|pair| pair[0].checked_add(1) == Some(pair[1])).count();
        // Lost packets leave larger steps.
        next >= FEWEST && 2 * next >= numbers.len()
    })
}

/// Refuses a file of packets: its headers would be read as samples.
pub fn refuse(path: &Path) -> Result<()> {
    let mut bytes = vec![];
    let longest = (LOOKED_AT * (PAYLOAD + HEADERS[1])) as u64;
    let read = files::regular(path).and_then(|file| file.take(longest).read_to_end(&mut bytes));
    read.map_err(|source| Error::read(path, source))?;
    let Some(header) = header(&bytes) else { return Ok(()) };
    let (found, whole) =
        (format!("packets of {PAYLOAD} bytes with headers of {header} bytes, numbered one by one"), header + PAYLOAD);
    Err(Error::field(path, "samples", found, "16-bit samples and nothing else").with_hint(format!(
        "put the packets in order and take the headers off: mmWave Studio does (Packet_Reorder_Zerofill), or of a file without lost packets \
         python -c \"b = open('{0}', 'rb').read(); open('samples.bin', 'wb').write(b''.join(b[i + {header}:i + {whole}] for i in \
         range(0, len(b), {whole})))\"",
        path.display()
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::support::numbers;

    /// Samples in packets, those of some numbers left out.
    fn packets(header: usize, count: u32, lost: &[u32]) -> Vec<u8> {
        let samples = numbers(3, PAYLOAD, -300.0, 300.0);
        let payload: Vec<u8> = samples.iter().flat_map(|value| (*value as i16).to_le_bytes()).take(PAYLOAD).collect();
        let packet = |number: u32| [&number.to_le_bytes()[..], &vec![0; header - 4], &payload].concat();
        (1..=count).filter(|number| !lost.contains(number)).flat_map(packet).collect()
    }

    #[test]
    fn packets_with_their_headers_are_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("adc_data.bin");
        for size in HEADERS {
            for lost in [&[][..], &[3, 7]] {
                std::fs::write(&path, packets(size, 12, lost)).unwrap();
                let error = refuse(&path).unwrap_err();
                assert!(error.to_string().contains(&format!("headers of {size} bytes")), "{error}");
                assert!(error.hint().unwrap().contains("Packet_Reorder_Zerofill"), "{:?}", error.hint());
            }
        }
    }

    #[test]
    fn samples_alone_are_no_packets() {
        let noise: Vec<u8> = numbers(4, 1 << 16, -300.0, 300.0).iter().flat_map(|value| (*value as i16).to_le_bytes()).collect();
        // Also what repeats itself from packet to packet, and what is silent.
        for samples in [noise, packets(10, 1, &[])[10..].repeat(64), vec![0; 1 << 16], vec![]] {
            assert_eq!(header(&samples), None);
        }
    }
}
