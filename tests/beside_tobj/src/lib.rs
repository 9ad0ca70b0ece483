//! Cargo gives all crates of a program the same features of a dependency. So firstlight asks for none of tobj's, and whoever
//! uses tobj beside it gets the numbers that tobj has by default.

#[cfg(test)]
mod tests {
    #[test]
    fn tobj_has_numbers_of_32_bits_and_firstlight_reads_64() {
        let text = "v 1000000.03 0 0\nv 1000001.28 0 0\nv 1000000.03 0.1 0\nf 1 2 3\n";
        let none = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
        let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &tobj::LoadOptions::default(), none).unwrap();
        let positions: &[f32] = &models[0].mesh.positions;
        assert_eq!((positions[0], positions[3]), (1_000_000.0, 1_000_001.25));

        let folder = std::env::temp_dir().join(format!("beside-tobj-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("far.obj");
        std::fs::write(&path, text).unwrap();
        let mesh = firstlight::scene::obj::load_obj(&path).unwrap().mesh;
        std::fs::remove_dir_all(&folder).unwrap();
        assert!((f64::from(mesh.positions[1].x) + mesh.center.x - 1_000_001.28).abs() < 1e-6);
    }
}
