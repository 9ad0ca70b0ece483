//! Mitsuba's own mesh files (`.serialized`): meshes one after the other, each deflated, with a directory at the end.
//!
//! Versions 3 and 4: positions, normals, texture coordinates and colours as arrays of `f32` or `f64`, then triangles.
//! Version 5: records of eight `f32` per vertex, and four `u32` per triangle.
//!
//! Source: <https://mitsuba.readthedocs.io/en/stable/src/generated/plugins_shapes.html#shape-serialized>

use firstlight_files::input_file::{FileKind, InputFile, ReadError};
use firstlight_files::limits::Limits;
use firstlight_mesh::Mesh;
use flate2::read::ZlibDecoder;
use glam::{DVec3, Vec2, Vec3};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

const MAGIC: u16 = 0x041c;
const NORMALS: u32 = 1;
const UVS: u32 = 2;
const COLORS: u32 = 8;
const FACE_NORMALS: u32 = 0x10;
const DOUBLE: u32 = 0x2000;
/// Of version 5.
const UVS_5: u32 = 4;
/// Bytes of the name of a mesh, which is not used.
const MAX_NAME: u64 = 1 << 16;

/// A mesh as in the file.
pub(crate) struct Read5 {
    pub mesh: Mesh,
    /// Whether the file wants flat shading.
    pub face_normals: bool,
}

/// Bytes that all meshes of a scene may still be decompressed to: a file may have many meshes at one place.
#[derive(Debug)]
pub(crate) struct UnpackedBytes {
    limit: u64,
    left: AtomicU64,
}

impl UnpackedBytes {
    pub(crate) fn new(limit: u64) -> Self {
        Self { limit, left: AtomicU64::new(limit) }
    }

    /// What the meshes of these files may be decompressed to.
    pub(crate) fn of_files<'a>(files: impl Iterator<Item = &'a Path>) -> Self {
        let length = |file: &Path| file.metadata().map_or(0, |info| info.len());
        let packed = files.map(length).fold(0, u64::saturating_add);
        Self::new(Limits::most_unpacked(packed))
    }
}

/// Reads the mesh of this index.
///
/// # Errors
/// A sentence that follows the path.
pub(crate) fn read_serialized(path: &Path, index: u32, room: &UnpackedBytes) -> Result<Read5, String> {
    let file = InputFile::open(path, FileKind::Model).map_err(|error| error.to_string())?;
    parse(file, index, Limits::of_this_process().model_bytes, room)
}

/// What is wrong with a file that cannot be read on.
fn unreadable(error: io::Error) -> String {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => "is damaged: it ends early".to_owned(),
        _ => ReadError::from(error).to_string(),
    }
}

fn read_array<const N: usize>(from: &mut impl Read) -> Result<[u8; N], String> {
    let mut bytes = [0; N];
    from.read_exact(&mut bytes).map_err(unreadable)?;
    Ok(bytes)
}

/// - `limit`: bytes of the decompressed mesh.
/// - `room`: of all meshes.
pub(crate) fn parse<R: Read + Seek>(
    mut file: R,
    index: u32,
    limit: u64,
    room: &UnpackedBytes,
) -> Result<Read5, String> {
    let [magic, version] = header(&mut file)?;
    if magic != MAGIC {
        return Err("is no serialized mesh of Mitsuba".to_owned());
    }
    if !(3..=5).contains(&version) {
        return Err(format!("has version {version}, but 3 to 5 can be read"));
    }
    if index > 0 {
        let start = offset(&mut file, index, version)?;
        let found = file.seek(SeekFrom::Start(start)).map_err(unreadable).and_then(|_| header(&mut file));
        if !matches!(found, Ok([MAGIC, _])) {
            return Err("is damaged: its directory points elsewhere".to_owned());
        }
    }
    let mut contents = Contents { from: ZlibDecoder::new(file).take(limit), limit, room };
    let flags = contents.u32()?;
    match version {
        5 => {
            let length = contents.u32()?;
            contents.bytes(u64::from(length))?;
            contents.version_5(flags)
        }
        _ => {
            let mut letters = 0..MAX_NAME;
            while version == 4 && contents.bytes(1)? != [0] {
                letters.next().ok_or("is damaged: the name of the mesh does not end")?;
            }
            contents.arrays(flags)
        }
    }
}

/// The number of the format, and the version.
fn header(file: &mut impl Read) -> Result<[u16; 2], String> {
    let [a, b, c, d] = read_array(file)?;
    Ok([[a, b], [c, d]].map(u16::from_le_bytes))
}

/// Of the mesh of this index, from the directory at the end.
fn offset(file: &mut (impl Read + Seek), index: u32, version: u16) -> Result<u64, String> {
    // There is a header of four bytes.
    let end = file.seek(SeekFrom::End(-4)).map_err(unreadable)?;
    let count = u32::from_le_bytes(read_array(file)?);
    if index >= count {
        return Err(format!("has {count} meshes: there is no mesh {index}, counted from 0"));
    }
    let size = if version == 3 { 4 } else { 8 };
    let entry = end.checked_sub(u64::from(count - index) * size).ok_or("is damaged: its directory is too short")?;
    file.seek(SeekFrom::Start(entry)).map_err(unreadable)?;
    Ok(match version {
        3 => u32::from_le_bytes(read_array(file)?).into(),
        _ => u64::from_le_bytes(read_array(file)?),
    })
}

struct Contents<'a, R> {
    from: std::io::Take<R>,
    limit: u64,
    room: &'a UnpackedBytes,
}

impl<R: Read> Contents<'_, R> {
    fn bytes(&mut self, count: u64) -> Result<Vec<u8>, String> {
        if count > self.from.limit() {
            return Err(format!("states more than {} bytes: {}", self.limit, Limits::advice()));
        }
        let left = &self.room.left;
        if count > left.load(Ordering::Relaxed) {
            let most = self.room.limit;
            return Err(format!("states more than the {most} bytes that all serialized meshes of the scene may have"));
        }
        // Grows as bytes arrive, whatever the file states.
        let mut bytes = Vec::with_capacity(count.min(1 << 20) as usize);
        let read = self.from.by_ref().take(count).read_to_end(&mut bytes);
        let _ = left
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| Some(left.saturating_sub(bytes.len() as u64)));
        match read {
            Ok(read) if read as u64 == count => Ok(bytes),
            Err(error) if error.get_ref().is_some_and(|error| error.is::<ReadError>()) => Err(unreadable(error)),
            _ => Err("is damaged: it ends early".to_owned()),
        }
    }

    fn u32(&mut self) -> Result<u32, String> {
        Ok(u32::from_le_bytes(*self.bytes(4)?.first_chunk().expect("four bytes were read")))
    }

    fn u64(&mut self) -> Result<u64, String> {
        Ok(u64::from_le_bytes(*self.bytes(8)?.first_chunk().expect("eight bytes were read")))
    }

    fn numbers(&mut self, count: u64, double: bool) -> Result<Vec<f64>, String> {
        let size = if double { 8 } else { 4 };
        let bytes = self.bytes(count.saturating_mul(size))?;
        Ok(match double {
            true => bytes.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect(),
            false => bytes.as_chunks().0.iter().map(|bytes| f64::from(f32::from_le_bytes(*bytes))).collect(),
        })
    }

    fn indices(&mut self, count: u64) -> Result<Vec<u32>, String> {
        let bytes = self.bytes(count.saturating_mul(4))?;
        Ok(bytes.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect())
    }

    fn arrays(mut self, flags: u32) -> Result<Read5, String> {
        let (vertices, faces, double) = (self.u64()?, self.u64()?, flags & DOUBLE != 0);
        let has = |flag: u32| u64::from(flags & flag != 0);
        let positions = self.numbers(vertices.saturating_mul(3), double)?;
        let normals = self.numbers(vertices.saturating_mul(3 * has(NORMALS)), double)?;
        let uvs = self.numbers(vertices.saturating_mul(2 * has(UVS)), double)?;
        self.numbers(vertices.saturating_mul(3 * has(COLORS)), double)?;
        let triangles = self.indices(faces.saturating_mul(3))?;
        let triangles = triangles.as_chunks().0.to_vec();
        built(&positions, &normals, &uvs, triangles, flags & FACE_NORMALS != 0)
    }

    fn version_5(mut self, flags: u32) -> Result<Read5, String> {
        let (vertices, faces) = (self.u64()?, self.u64()?);
        // Numbers of places and of groups of normals, which only Mitsuba's editing needs.
        self.bytes(16)?;
        let records = self.numbers(vertices.saturating_mul(8), false)?;
        let lanes = |from: usize, to: usize| -> Vec<f64> {
            records.as_chunks::<8>().0.iter().flat_map(|record| record[from..to].iter().copied()).collect()
        };
        // With stored tangents, the lanes of the normal hold an encoded frame.
        let is_normal = flags & 3 == NORMALS;
        let normals = if is_normal { lanes(3, 6) } else { Vec::new() };
        let uvs = if flags & UVS_5 != 0 { lanes(6, 8) } else { Vec::new() };
        let indices = self.indices(faces.saturating_mul(4))?;
        let triangles = indices.as_chunks::<4>().0.iter().map(|&[a, b, c, _]| [a, b, c]).collect();
        built(&lanes(0, 3), &normals, &uvs, triangles, flags & FACE_NORMALS != 0)
    }
}

fn built(
    positions: &[f64],
    normals: &[f64],
    uvs: &[f64],
    triangles: Vec<[u32; 3]>,
    face_normals: bool,
) -> Result<Read5, String> {
    let positions: Vec<DVec3> = positions.as_chunks().0.iter().map(|at| DVec3::from_array(*at)).collect();
    let mut mesh = Mesh::from_f64(&positions, triangles).map_err(|error| error.to_string())?;
    let unit = |normal: &[f64; 3]| DVec3::from_array(*normal).try_normalize().map(|unit| unit.as_vec3());
    let normals: Option<Vec<Vec3>> = normals.as_chunks().0.iter().map(unit).collect();
    mesh.normals = normals.unwrap_or_default();
    let finite = |uv: &[f64; 2]| uv.map(|it| if it.is_finite() { it as f32 } else { 0.0 });
    mesh.uvs = uvs.as_chunks().0.iter().map(|uv| Vec2::from_array(finite(uv))).collect();
    mesh.validate().map_err(|error| error.to_string())?;
    Ok(Read5 { mesh, face_normals })
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::Compression;
    use flate2::write::ZlibEncoder;
    use std::io::{Cursor, Write};

    static ROOM: UnpackedBytes = UnpackedBytes { limit: u64::MAX, left: AtomicU64::new(u64::MAX) };

    fn file(version: u16, contents: &[&[u8]]) -> Vec<u8> {
        let (mut bytes, mut directory) = (Vec::new(), Vec::new());
        for mesh in contents {
            directory.extend((bytes.len() as u64).to_le_bytes());
            bytes.extend(MAGIC.to_le_bytes());
            bytes.extend(version.to_le_bytes());
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
            encoder.write_all(mesh).unwrap();
            bytes.extend(encoder.finish().unwrap());
        }
        bytes.extend(directory);
        bytes.extend((contents.len() as u32).to_le_bytes());
        bytes
    }

    fn triangle(size: f32) -> Vec<u8> {
        let mut mesh = (NORMALS | UVS | 0x1000).to_le_bytes().to_vec();
        mesh.extend(b"name\0");
        mesh.extend([3_u64, 1].iter().flat_map(|count| count.to_le_bytes()));
        let numbers = [0.0, 0.0, 0.0, size, 0.0, 0.0, 0.0, size, 0.0];
        let normals = [0.0, 0.0, 2.0].repeat(3);
        let uvs = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
        mesh.extend(numbers.iter().chain(&normals).chain(&uvs).flat_map(|number: &f32| number.to_le_bytes()));
        mesh.extend([0_u32, 1, 2].iter().flat_map(|index| index.to_le_bytes()));
        mesh
    }

    #[test]
    fn the_mesh_of_each_index_is_read() {
        let bytes = file(4, &[&triangle(1.0), &triangle(3.0)]);
        for (index, area) in [(0, 0.5), (1, 4.5)] {
            let Read5 { mesh, face_normals } =
                parse(Cursor::new(&bytes), index, 1 << 20, &ROOM).unwrap_or_else(|why| panic!("{why}"));
            assert_eq!((mesh.area(), face_normals), (area, false));
            assert_eq!((mesh.normals[2], mesh.uvs[1]), (Vec3::Z, Vec2::X));
        }
        let wrong = |index, limit| parse(Cursor::new(&bytes), index, limit, &ROOM).err().unwrap();
        assert!(wrong(2, 1 << 20).contains("2 meshes"), "{}", wrong(2, 1 << 20));
        assert!(wrong(1, 100).contains("more than 100 bytes"), "{}", wrong(1, 100));
    }

    /// Counts the bytes that are read.
    struct Counted<'a>(Cursor<&'a [u8]>, &'a AtomicU64);

    impl Read for Counted<'_> {
        fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
            let read = self.0.read(bytes)?;
            self.1.fetch_add(read as u64, Ordering::Relaxed);
            Ok(read)
        }
    }

    impl Seek for Counted<'_> {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.0.seek(to)
        }
    }

    #[test]
    fn a_mesh_is_read_without_the_others() {
        let unread = vec![0; 1 << 20];
        let bytes = [file(4, &[&triangle(1.0)]), unread].concat();
        // A directory whose second mesh begins where the first does.
        let bytes = [bytes, [0_u64; 2].map(u64::to_le_bytes).concat(), 2_u32.to_le_bytes().to_vec()].concat();
        for index in 0..2 {
            let n_read = AtomicU64::new(0);
            let read = parse(Counted(Cursor::new(&bytes), &n_read), index, 1 << 20, &ROOM);
            assert_eq!(read.unwrap_or_else(|why| panic!("{why}")).mesh.area(), 0.5);
            assert!(n_read.into_inner() < 1 << 17);
        }
    }

    #[test]
    fn meshes_at_one_place_have_their_bytes_once() {
        let bytes = file(4, &[&triangle(1.0)]);
        let room = UnpackedBytes::new(2 * triangle(1.0).len() as u64);
        let mut read = std::iter::repeat_with(|| parse(Cursor::new(&bytes), 0, 1 << 20, &room));
        assert!(read.next().unwrap().is_ok() && read.next().unwrap().is_ok());
        let why = read.next().unwrap().err().unwrap();
        assert!(why.contains("all serialized meshes"), "{why}");
    }

    #[test]
    fn a_name_that_does_not_end_is_no_name() {
        let bytes = file(4, &[&vec![b'a'; 1 << 20]]);
        let why = parse(Cursor::new(&bytes), 0, 1 << 30, &ROOM).err().unwrap();
        assert!(why.contains("name of the mesh"), "{why}");
    }

    #[test]
    fn no_part_of_a_file_is_read_beyond_its_end() {
        let bytes = file(4, &[&triangle(1.0), &triangle(3.0)]);
        for length in 0..bytes.len() {
            for index in 0..2 {
                let _ = parse(Cursor::new(&bytes[..length]), index, 1 << 20, &ROOM);
            }
        }
        for at in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] ^= 0x55;
            let _ = parse(Cursor::new(&changed), 1, 1 << 20, &ROOM);
        }
    }
}
