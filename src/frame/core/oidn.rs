//! Open Image Denoise, where it is installed: a filter from noisy radiance, albedo and normal to radiance.
//!
//! The library is loaded at run time, so that firstlight needs it neither to be built nor to run, and contains none of
//! its code (it has the Apache License 2.0). Uses the C interface of version 2: a device on the processor and the filter
//! `RT`. What the filter gives is combined with the raw image like the result of firstlight's own filter
//! ([`denoise_source_with`](crate::render::denoise_source_with)).
//!
//! Its result may depend on its version and on the instruction set.

use crate::render::{DenoiseSource, Denoised, SurfaceGuides, denoise_source_with};
use glam::Vec3;
use libloading::{Library, Symbol};
use std::ffi::{CStr, OsString, c_char, c_int, c_void};
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Names the library if it is not where the system looks for libraries.
pub const PATH_VARIABLE: &str = "FIRSTLIGHT_OIDN";

#[cfg(target_os = "windows")]
const NAMES: [&str; 1] = ["OpenImageDenoise.dll"];
#[cfg(target_os = "macos")]
const NAMES: [&str; 2] = ["libOpenImageDenoise.2.dylib", "libOpenImageDenoise.dylib"];
#[cfg(not(any(target_os = "windows", target_os = "macos")))]
const NAMES: [&str; 2] = ["libOpenImageDenoise.so.2", "libOpenImageDenoise.so"];

/// Why Open Image Denoise cannot be used; the text says what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OidnError {
    /// The system has no such library.
    #[error(
        "Open Image Denoise is not installed: {} was not found. Install it (openimagedenoise.org, or the packages of \
         your system), or set {PATH_VARIABLE} to the path of the library",
        NAMES[0]
    )]
    Missing,
    /// The library that the user named cannot be loaded.
    #[error("{PATH_VARIABLE}: {path} cannot be loaded: {reason}")]
    Unreadable {
        /// As the user wrote it.
        path: String,
        /// Description by the system.
        reason: String,
    },
    /// The library has another interface.
    #[error("{library} has no function {function}: Open Image Denoise 2 or later is needed")]
    Version {
        /// File name or path.
        library: String,
        /// The first one that is missing.
        function: String,
    },
    /// The library reports an error.
    #[error("Open Image Denoise: {0}")]
    Failed(String),
}

/// OidnHandle of an object of the library; null if it could not be made.
type OidnHandle = *mut c_void;

/// The loaded library with a device.
pub struct Oidn {
    calls: Calls,
    /// One image at a time.
    device: Mutex<Device>,
    /// Never unloaded: its threads may outlive the device.
    _library: ManuallyDrop<Library>,
}

struct Device(OidnHandle);

// SAFETY: a device may be used by any thread, as long as it is by one at a time; the mutex sees to that.
unsafe impl Send for Device {}

/// Functions of the C interface.
struct Calls {
    new_device: unsafe extern "C" fn(c_int) -> OidnHandle,
    set_device_bool: unsafe extern "C" fn(OidnHandle, *const c_char, bool),
    set_device_int: unsafe extern "C" fn(OidnHandle, *const c_char, c_int),
    commit_device: unsafe extern "C" fn(OidnHandle),
    release_device: unsafe extern "C" fn(OidnHandle),
    device_error: unsafe extern "C" fn(OidnHandle, *mut *const c_char) -> c_int,
    new_filter: unsafe extern "C" fn(OidnHandle, *const c_char) -> OidnHandle,
    set_image: unsafe extern "C" fn(OidnHandle, *const c_char, OidnHandle, c_int, usize, usize, usize, usize, usize),
    set_filter_bool: unsafe extern "C" fn(OidnHandle, *const c_char, bool),
    commit_filter: unsafe extern "C" fn(OidnHandle),
    execute_filter: unsafe extern "C" fn(OidnHandle),
    release_filter: unsafe extern "C" fn(OidnHandle),
}

/// `OIDN_DEVICE_TYPE_CPU`: the same result whatever graphics card there is.
const CPU: c_int = 1;
/// `OIDN_FORMAT_FLOAT3`.
const FLOAT3: c_int = 3;
const _: () = assert!(size_of::<Vec3>() == 12, "pixels are three floats without padding");

/// The images of one call; all lists are row by row from the top, with `width * height` entries.
#[derive(Clone, Copy)]
pub struct OidnInput<'a> {
    /// Pixels.
    pub width: usize,
    /// Pixels.
    pub height: usize,
    /// Radiance, linear Rec. 709.
    pub color: &'a [Vec3],
    /// 0..1 per channel.
    pub albedo: &'a [Vec3],
    /// Components −1..1.
    pub normal: &'a [Vec3],
}

impl Oidn {
    /// Loads the library named by [`PATH_VARIABLE`], or else the installed one.
    ///
    /// - `threads`: of its device, at least 1.
    ///
    /// # Errors
    /// If there is none, or it cannot be used.
    pub fn load(threads: usize) -> Result<Self, OidnError> {
        // Empty like not set, as in most programs.
        Self::load_from(std::env::var_os(PATH_VARIABLE).filter(|path| !path.is_empty()), threads)
    }

    fn load_from(path: Option<OsString>, threads: usize) -> Result<Self, OidnError> {
        // SAFETY: loading runs the initialisation of the library, which is that of Open Image Denoise, or what the user
        // names in its place.
        let open = |path: &Path| unsafe { Library::new(path) };
        let (library, name) = match path.map(|path| in_folder(path.into())) {
            Some(path) => {
                let name = path.to_string_lossy().into_owned();
                // The system would wait for somebody to write into a pipe.
                if path.exists() && !path.is_file() {
                    return Err(OidnError::Unreadable { path: name, reason: "it is not a regular file".to_owned() });
                }
                match open(&path) {
                    Ok(library) => (library, name),
                    Err(error) => return Err(OidnError::Unreadable { path: name, reason: error.to_string() }),
                }
            }
            None => {
                let mut installed =
                    NAMES.iter().filter_map(|name| Some((open(Path::new(name)).ok()?, (*name).to_owned())));
                installed.next().ok_or(OidnError::Missing)?
            }
        };
        let library = ManuallyDrop::new(library);
        let calls = Calls::of(&library, &name)?;
        // SAFETY: arguments as `oidn.h` has them; texts end in zero.
        let device = unsafe {
            let device = (calls.new_device)(CPU);
            (calls.set_device_bool)(device, c"setAffinity".as_ptr(), false);
            (calls.set_device_int)(device, c"numThreads".as_ptr(), c_int::try_from(threads).unwrap_or(c_int::MAX));
            (calls.commit_device)(device);
            device
        };
        let oidn = Self { calls, device: Mutex::new(Device(device)), _library: library };
        oidn.check(device).map(|()| oidn)
    }

    /// Denoises like [`denoise_source`](crate::render::denoise_source), with this filter; `None` if `stop` returned true.
    ///
    /// # Errors
    /// If the library reports one.
    ///
    /// # Panics
    /// If source and guides differ in size.
    pub fn denoise(
        &self,
        source: &DenoiseSource,
        guides: &SurfaceGuides,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Denoised>, OidnError> {
        let mut failure = None;
        let mut filter =
            |color: &[Vec3]| self.filter(&input_of(color, source, guides)).map_err(|error| failure = Some(error)).ok();
        let found = denoise_source_with(source, guides, &mut filter, stop);
        failure.map_or(Ok(found), Err)
    }

    /// Filters a film, without a combination.
    ///
    /// # Errors
    /// If the library reports one.
    ///
    /// # Panics
    /// If source and guides differ in size.
    pub fn filter_source(&self, source: &DenoiseSource, guides: &SurfaceGuides) -> Result<Vec<Vec3>, OidnError> {
        self.filter(&input_of(&source.color, source, guides))
    }

    /// Filters an image.
    ///
    /// # Errors
    /// If the library reports one.
    ///
    /// # Panics
    /// If a list does not have one entry per pixel.
    pub fn filter(&self, input: &OidnInput) -> Result<Vec<Vec3>, OidnError> {
        let OidnInput { width, height, color, albedo, normal } = *input;
        let n = width * height;
        assert_eq!([color.len(), albedo.len(), normal.len()], [n; 3], "lists for {n} pixels");
        let mut output = vec![Vec3::ZERO; n];
        let device = self.device.lock().unwrap_or_else(PoisonError::into_inner);
        let calls = &self.calls;
        // SAFETY: each image has width × height pixels of three floats without gaps, and lives until the filter is
        // released; the library reads the first three and writes the last.
        unsafe {
            let filter = (calls.new_filter)(device.0, c"RT".as_ptr());
            let image = |name: &CStr, pixels: *mut Vec3| {
                (calls.set_image)(filter, name.as_ptr(), pixels.cast(), FLOAT3, width, height, 0, 0, 0);
            };
            image(c"color", color.as_ptr().cast_mut());
            image(c"albedo", albedo.as_ptr().cast_mut());
            image(c"normal", normal.as_ptr().cast_mut());
            image(c"output", output.as_mut_ptr());
            (calls.set_filter_bool)(filter, c"hdr".as_ptr(), true);
            (calls.commit_filter)(filter);
            (calls.execute_filter)(filter);
            (calls.release_filter)(filter);
        }
        self.check(device.0).map(|()| output)
    }

    /// The last error of the device.
    fn check(&self, device: OidnHandle) -> Result<(), OidnError> {
        let mut message = std::ptr::null();
        // SAFETY: the library sets the message to null or to a text that it keeps until the next call.
        unsafe {
            match (self.calls.device_error)(device, &raw mut message) {
                0 => Ok(()),
                code if message.is_null() => Err(OidnError::Failed(format!("error {code}"))),
                _ => Err(OidnError::Failed(CStr::from_ptr(message).to_string_lossy().into_owned())),
            }
        }
    }
}

/// - `color`: the radiance to filter.
fn input_of<'a>(color: &'a [Vec3], source: &DenoiseSource, guides: &'a SurfaceGuides) -> OidnInput<'a> {
    let SurfaceGuides { albedo, normal, .. } = guides;
    OidnInput { width: source.width as usize, height: source.height as usize, color, albedo, normal }
}

impl Drop for Oidn {
    fn drop(&mut self) {
        let device = self.device.get_mut().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: nobody else has the device, and no filter of it is left.
        unsafe { (self.calls.release_device)(device.0) };
    }
}

/// The library in a folder, or the path itself if it is none.
fn in_folder(path: PathBuf) -> PathBuf {
    if !path.is_dir() {
        return path;
    }
    NAMES.iter().map(|name| path.join(name)).find(|path| path.exists()).unwrap_or_else(|| path.join(NAMES[0]))
}

impl Calls {
    /// - `file`: name or path of the library.
    fn of(library: &Library, file: &str) -> Result<Self, OidnError> {
        /// The function of this name; its type must be that of `oidn.h`.
        fn find<T: Copy>((library, file): (&Library, &str), name: &str) -> Result<T, OidnError> {
            // SAFETY: the fields of `Calls` have the types of the functions.
            let symbol: Result<Symbol<T>, _> = unsafe { library.get(name.as_bytes()) };
            let missing = || OidnError::Version { library: file.to_owned(), function: name.to_owned() };
            symbol.map(|symbol| *symbol).map_err(|_| missing())
        }
        let library = (library, file);
        Ok(Self {
            new_device: find(library, "oidnNewDevice")?,
            set_device_bool: find(library, "oidnSetDeviceBool")?,
            set_device_int: find(library, "oidnSetDeviceInt")?,
            commit_device: find(library, "oidnCommitDevice")?,
            release_device: find(library, "oidnReleaseDevice")?,
            device_error: find(library, "oidnGetDeviceError")?,
            new_filter: find(library, "oidnNewFilter")?,
            set_image: find(library, "oidnSetSharedFilterImage")?,
            set_filter_bool: find(library, "oidnSetFilterBool")?,
            commit_filter: find(library, "oidnCommitFilter")?,
            execute_filter: find(library, "oidnExecuteFilter")?,
            release_filter: find(library, "oidnReleaseFilter")?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_told_with_what_to_do() {
        let missing = OidnError::Missing.to_string();
        assert!(missing.contains("not installed") && missing.contains(PATH_VARIABLE), "{missing}");
        let error = Oidn::load_from(Some("nowhere/library.so".into()), 1).map(drop).unwrap_err();
        assert!(matches!(&error, OidnError::Unreadable { path, .. } if path == "nowhere/library.so"), "{error:?}");
        assert!(error.to_string().starts_with("FIRSTLIGHT_OIDN: nowhere/library.so cannot be loaded"), "{error}");
        #[cfg(unix)]
        {
            // Not a file: a pipe would be waited for.
            let error = Oidn::load_from(Some("/dev/null".into()), 1).map(drop).unwrap_err().to_string();
            assert!(error.contains("/dev/null cannot be loaded: it is not a regular file"), "{error}");
        }
    }

    /// Only where the library is installed, or named by the variable.
    #[test]
    fn noise_on_an_even_wall_is_gone() {
        let Ok(oidn) = Oidn::load(1) else { return };
        let (width, height) = (64, 48);
        let noise = |i: usize| ((i * 7919) % 101) as f32 / 100.0;
        let color: Vec<Vec3> = (0..width * height).map(|i| Vec3::splat(0.25 + 0.5 * noise(i))).collect();
        let albedo = vec![Vec3::splat(0.5); color.len()];
        let normal = vec![Vec3::Z; color.len()];
        let found = oidn.filter(&OidnInput { width, height, color: &color, albedo: &albedo, normal: &normal }).unwrap();
        let off = |colors: &[Vec3]| colors.iter().map(|color| (color.x - 0.5).powi(2)).sum::<f32>();
        assert!(off(&found) < 0.05 * off(&color), "{} of {}", off(&found), off(&color));
    }
}
