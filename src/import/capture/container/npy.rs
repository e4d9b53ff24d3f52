//! `.npy`: one array, as it lies.

use std::path::{Path, PathBuf};

use super::{Container, Entry, Laid, Plane};
use crate::data::arrays::{Header, field_of, open};
use crate::error::Result;

pub(super) struct Npy {
    path: PathBuf,
    header: Header,
}

impl Npy {
    pub fn open(path: &Path) -> Result<Self> {
        let (mut reader, size) = open(path)?;
        let header = Header::read(&mut reader, size)
            .and_then(|header| header.check_size(size).map(|()| header))
            .map_err(|problem| problem.at(path, &field_of(path)))?;
        Ok(Self { path: path.into(), header })
    }
}

impl Container for Npy {
    fn entries(&self) -> Vec<Entry> {
        vec![Entry { name: field_of(&self.path), shape: self.header.shape.clone() }]
    }

    fn lay_out(&mut self, _: &str, _: &Path) -> Result<Laid> {
        let Header { stored, fortran, shape, data_start } = self.header.clone();
        Ok(Laid { shape, fortran, planes: vec![Plane { file: self.path.clone(), start: data_start, stored }] })
    }
}
