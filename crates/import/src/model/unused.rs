//! Vertices that no triangle uses.

/// Renumbers the vertices of triangles as if unused ones were removed; returns which are used, unless all are.
///
/// - `n_vertices`: all indices are below.
pub(crate) fn renumber(triangles: &mut [[u32; 3]], n_vertices: usize) -> Option<Vec<bool>> {
    let mut used = vec![false; n_vertices];
    triangles.iter().flatten().for_each(|&vertex| used[vertex as usize] = true);
    if used.iter().all(|&used| used) {
        return None;
    }
    let mut next = 0;
    let number = |&used: &bool| {
        next += u32::from(used);
        next - u32::from(used)
    };
    let numbers: Vec<u32> = used.iter().map(number).collect();
    triangles.iter_mut().flatten().for_each(|vertex| *vertex = numbers[*vertex as usize]);
    Some(used)
}

/// Keeps what is marked; the list may be empty.
pub(crate) fn keep<T>(list: &mut Vec<T>, marked: &[bool]) {
    let mut marked = marked.iter();
    list.retain(|_| *marked.next().expect("a list is empty or has as many entries as marks"));
}
