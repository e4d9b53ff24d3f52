//! `.npz`: each member is a `.npy`, stored or deflated.

use std::path::Path;

use num_complex::Complex;

use super::{Container, Entry, Laid, Plane, copy_out};
use crate::data::arrays::{Element, Header, Npz, Problem};
use crate::error::Result;

pub(super) struct Archive {
    archive: Npz,
    headers: Vec<(String, Header)>,
}

impl Archive {
    pub fn open(path: &Path) -> Result<Self> {
        let mut archive = Npz::open(path)?;
        let headers = archive.names().into_iter().filter_map(|name| {
            // Members that hold no plain numbers (texts, objects) are no captures.
            let header = archive.with_member(&name, |member, size| Header::read(member, size)).ok()?;
            let is_number = f32::accepts(header.stored) || Complex::<f32>::accepts(header.stored);
            is_number.then_some((name, header))
        });
        let headers = headers.collect();
        Ok(Self { archive, headers })
    }
}

impl Container for Archive {
    fn entries(&self) -> Vec<Entry> {
        self.headers.iter().map(|(name, header)| Entry { name: name.clone(), shape: header.shape.clone() }).collect()
    }

    fn lay_out(&mut self, name: &str, scratch: &Path) -> Result<Laid> {
        // A name may be that of a folder inside the archive.
        let file = scratch.join(format!("{}.raw", name.replace(['/', '\\'], "_")));
        let header = self.archive.with_member(name, |member, size| {
            let header = Header::read(member, size)?;
            header.check_size(size)?;
            copy_out(member, header.data_bytes(), &file).map_err(|error| match error.raw_os_error() {
                Some(_) => Problem::Io(error),
                None => Problem::new(format!("damaged ({error})"), format!("{} bytes of numbers", header.data_bytes()))
                    .with_hint("copy or download the file again"),
            })?;
            Ok(header)
        })?;
        let Header { stored, fortran, shape, .. } = header;
        Ok(Laid { shape, fortran, planes: vec![Plane { file, start: 0, stored }] })
    }
}
