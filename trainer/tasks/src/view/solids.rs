//! Solids and meshes as the page reads them, thinned out where they are large.

use std::collections::HashMap;

use serde::Serialize;

use crate::page::base64;
use crate::task::{Form, Mesh, Scene, Solid};

/// Bytes that all meshes of a page may take before Base64; above this they are thinned out.
const MESH_BYTES: usize = 5_000_000;

#[derive(Debug, Serialize)]
pub(super) struct DrawnSolid {
    name: String,
    form: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh: Option<usize>,
    size: [f32; 3],
    colour: [f32; 4],
}

impl DrawnSolid {
    pub(super) fn new(solid: &Solid) -> Self {
        let (form, mesh) = match solid.form {
            Form::Plane => ("plane", None),
            Form::Sphere => ("sphere", None),
            Form::Capsule => ("capsule", None),
            Form::Ellipsoid => ("ellipsoid", None),
            Form::Cylinder => ("cylinder", None),
            Form::Box => ("box", None),
            Form::Mesh(mesh) => ("mesh", Some(mesh)),
        };
        DrawnSolid {
            name: solid.name.clone(),
            form,
            mesh,
            size: solid.size,
            colour: solid.colour,
        }
    }
}

/// A mesh whose corners are shares of the box around it, 0 to 65535.
#[derive(Debug, Serialize)]
pub(super) struct DrawnMesh {
    low: [f32; 3],
    high: [f32; 3],
    /// Two bytes each, as Base64.
    points: String,
    /// Four bytes each, as Base64.
    corners: String,
}

/// The meshes of a scene, together not much larger than [`MESH_BYTES`].
pub(super) fn meshes(scene: &Scene) -> Vec<DrawnMesh> {
    let bytes: usize = scene.meshes.iter().map(size).sum();
    let drawn = |mesh: &Mesh| match bytes > MESH_BYTES {
        true => encoded(&thinned(
            mesh,
            size(mesh) as u64 * MESH_BYTES as u64 / bytes as u64,
        )),
        false => encoded(mesh),
    };
    scene.meshes.iter().map(drawn).collect()
}

const fn size(mesh: &Mesh) -> usize {
    6 * mesh.points.len() + 12 * mesh.triangles.len()
}

/// The least box around points.
fn bounds(points: &[[f32; 3]]) -> [[f32; 3]; 2] {
    let corner = |pick: fn(f32, f32) -> f32| -> [f32; 3] {
        let first = points.first().copied().unwrap_or_default();
        (points.iter()).fold(first, |a, b| std::array::from_fn(|i| pick(a[i], b[i])))
    };
    [corner(f32::min), corner(f32::max)]
}

/// Where a point lies in a box, cut into so many slices along each axis.
fn slice(point: [f32; 3], [low, high]: [[f32; 3]; 2], slices: f32) -> [u16; 3] {
    std::array::from_fn(|i| {
        let width = high[i] - low[i];
        let share = if width > 0.0 {
            (point[i] - low[i]) / width
        } else {
            0.0
        };
        (share * slices).round() as u16
    })
}

fn encoded(mesh: &Mesh) -> DrawnMesh {
    let [low, high] = bounds(&mesh.points);
    let points = mesh.points.iter();
    let points = points.flat_map(|point| slice(*point, [low, high], 65_535.0));
    let points: Vec<u8> = points.flat_map(u16::to_le_bytes).collect();
    let corners = mesh.triangles.as_flattened().iter();
    let corners: Vec<u8> = corners.flat_map(|corner| corner.to_le_bytes()).collect();
    DrawnMesh {
        low,
        high,
        points: base64(&points),
        corners: base64(&corners),
    }
}

/// A mesh of at most so many bytes: points that share a cell of a grid become one, and the grid is as fine as may be.
fn thinned(mesh: &Mesh, bytes: u64) -> Mesh {
    let mut slices = 512.0;
    loop {
        let coarse = on_a_grid(mesh, slices);
        if size(&coarse) as u64 <= bytes || slices < 4.0 {
            return coarse;
        }
        slices *= 0.75;
    }
}

fn on_a_grid(mesh: &Mesh, slices: f32) -> Mesh {
    let bounds = bounds(&mesh.points);
    let mut cells: HashMap<[u16; 3], u32> = HashMap::new();
    let mut coarse = Mesh::default();
    let number: Vec<u32> = (mesh.points.iter())
        .map(|point| {
            *cells
                .entry(slice(*point, bounds, slices))
                .or_insert_with(|| {
                    coarse.points.push(*point);
                    coarse.points.len() as u32 - 1
                })
        })
        .collect();
    let moved = |corner: u32| number.get(corner as usize).copied().unwrap_or(0);
    let triangles = mesh.triangles.iter().map(|corners| corners.map(moved));
    coarse.triangles = triangles
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .collect();
    coarse
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of so many points along each side, with a bump.
    fn sheet(n: u32) -> Mesh {
        let place = |k: u32| k as f32 / (n - 1) as f32;
        let point = |k: u32| {
            let (x, y) = (place(k % n), place(k / n));
            [x, y, x * y]
        };
        let squares = (0..n - 1).flat_map(|row| (0..n - 1).map(move |column| row * n + column));
        Mesh {
            points: (0..n * n).map(point).collect(),
            triangles: squares
                .flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]])
                .collect(),
        }
    }

    #[test]
    fn a_large_mesh_keeps_its_outline_in_fewer_bytes() {
        let mesh = sheet(300);
        let coarse = thinned(&mesh, 100_000);
        assert!(size(&coarse) <= 100_000 && size(&coarse) > 30_000);
        assert!(
            coarse
                .triangles
                .as_flattened()
                .iter()
                .all(|corner| (*corner as usize) < coarse.points.len())
        );
        let ([low, high], [coarse_low, coarse_high]) =
            (bounds(&mesh.points), bounds(&coarse.points));
        for i in 0..3 {
            assert!(
                (low[i] - coarse_low[i]).abs() < 0.05 && (high[i] - coarse_high[i]).abs() < 0.05
            );
        }
    }

    #[test]
    fn meshes_are_thinned_only_where_together_they_are_too_large() {
        let drawn = |count: usize, n: u32| {
            let scene = Scene {
                solids: Vec::new(),
                meshes: vec![sheet(n); count],
            };
            let meshes = meshes(&scene);
            meshes
                .iter()
                .map(|mesh| (mesh.points.len() + mesh.corners.len()) * 3 / 4)
                .sum::<usize>()
        };
        let small = drawn(1, 100);
        assert!(small.abs_diff(size(&sheet(100))) < 8, "as it is: {small}");
        assert!(drawn(4, 300) < MESH_BYTES + 100);
    }

    #[test]
    fn a_mesh_without_points_is_no_fault() {
        let mesh = encoded(&Mesh::default());
        assert!(mesh.points.is_empty() && mesh.corners.is_empty());
    }
}
