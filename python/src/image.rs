//! An image: its numbers as bytes for numpy.

use crate::arrays::bytes_of;
use crate::errors::{input, of_library};
use firstlight::glam::Vec3;
use firstlight::render::{IdShares, relative_errors};
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes};
use std::path::PathBuf;

#[pyclass(frozen, module = "firstlight._firstlight")]
pub struct Image(firstlight::Image);

impl Image {
    pub fn new(image: firstlight::Image) -> Self {
        Self(image)
    }

    fn n_pixels(&self) -> usize {
        self.0.width() as usize * self.0.height() as usize
    }

    fn vectors<'py>(&self, py: Python<'py>, list: &[Vec3]) -> PyResult<Bound<'py, PyByteArray>> {
        bytes_of(py, self.n_pixels(), list.iter().map(|v| v.to_array().map(f32::to_ne_bytes)))
    }

    fn numbers<'py>(&self, py: Python<'py>, list: &[f32]) -> PyResult<Bound<'py, PyByteArray>> {
        bytes_of(py, self.n_pixels(), list.iter().map(|x| [x.to_ne_bytes()]))
    }

    /// The index that most samples of each pixel hit; -1 for none.
    fn ids<'py>(&self, py: Python<'py>, list: &[IdShares]) -> PyResult<Bound<'py, PyByteArray>> {
        let first = |shares: &IdShares| shares.iter().next().map_or(-1, |(id, _)| id as i32);
        bytes_of(py, self.n_pixels(), list.iter().map(|shares| [first(shares).to_ne_bytes()]))
    }
}

#[pymethods]
impl Image {
    #[getter]
    fn width(&self) -> u32 {
        self.0.width()
    }

    #[getter]
    fn height(&self) -> u32 {
        self.0.height()
    }

    #[getter]
    fn spp(&self) -> u32 {
        self.0.spp()
    }

    #[getter]
    fn seconds(&self) -> f64 {
        self.0.report().seconds
    }

    #[getter]
    fn rays(&self) -> u64 {
        self.0.report().rays.total()
    }

    /// Estimate and interval of the relative error.
    #[getter]
    fn error(&self) -> Option<(f64, f64, f64)> {
        self.0.error().map(|error| (error.relative, error.low, error.high))
    }

    #[getter]
    fn denoised_error(&self) -> Option<(f64, f64, f64)> {
        self.0.denoised().map(|denoised| (denoised.error, denoised.error_95[0], denoised.error_95[1]))
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings().iter().map(ToString::to_string).collect()
    }

    fn pixels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyByteArray>> {
        bytes_of(py, 3 * self.n_pixels(), self.0.pixels().iter().map(|x| [x.to_ne_bytes()]))
    }

    /// The denoised image; none if it was not asked for.
    fn denoised<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyByteArray>>> {
        self.0.denoised().map(|denoised| self.vectors(py, &denoised.color)).transpose()
    }

    /// A layer: three numbers per pixel, one number, or one index.
    fn layer<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Option<Bound<'py, PyByteArray>>> {
        if name == "error" {
            return relative_errors(self.0.film()).map(|errors| self.numbers(py, &errors)).transpose();
        }
        if name == "samples" {
            let (film, (width, height)) = (self.0.film(), (self.0.width(), self.0.height()));
            let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
            let samples = pixels.map(|(x, y)| [(film.samples(x, y) as i32).to_ne_bytes()]);
            return bytes_of(py, self.n_pixels(), samples).map(Some);
        }
        let buffers = &self.0.features().ok_or_else(|| input("the image was rendered without layers"))?.buffers;
        let ids = buffers.ids.as_ref();
        match (name, ids) {
            ("albedo", _) => self.vectors(py, &buffers.albedo),
            ("normal", _) => self.vectors(py, &buffers.normal),
            ("position", _) => self.vectors(py, &buffers.position),
            ("depth", _) => self.numbers(py, &buffers.depth),
            ("coverage", _) => self.numbers(py, &buffers.coverage),
            ("object", Some(ids)) => self.ids(py, &ids.objects),
            ("material", Some(ids)) => self.ids(py, &ids.materials),
            _ => Err(input(format!("there is no layer `{name}`"))),
        }
        .map(Some)
    }

    /// Names of the objects and of the materials by the indices of the layers.
    fn layer_names(&self) -> (Vec<String>, Vec<String>) {
        self.0.features().map(|layers| (layers.objects.clone(), layers.materials.clone())).unwrap_or_default()
    }

    fn png<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &py.detach(|| self.0.png()).map_err(of_library)?))
    }

    fn rgba<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyByteArray>> {
        Ok(PyByteArray::new(py, &py.detach(|| self.0.to_rgba()).map_err(of_library)?))
    }

    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.0.save(path)).map_err(of_library)
    }
}
