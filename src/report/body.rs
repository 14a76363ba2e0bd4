//! The forms of rigid bodies as triangles that the page can draw. Uses `geometry` and the other files of this module.

use super::data::Mesh;
use crate::geometry::{Point, Vector};

/// Sides of a drawn cylinder.
const AROUND: usize = 48;
/// Triangles up to which each is shaded flat; larger meshes share their corners.
const SHADED_FLAT: usize = 20_000;

impl Mesh {
    /// Triangles, each with its own normal.
    pub fn flat(triangles: impl IntoIterator<Item = [Point; 3]>) -> Self {
        let mut mesh = Self::default();
        for [a, b, c] in triangles {
            let first = mesh.points.len() as u32;
            mesh.points.extend([a, b, c]);
            mesh.normals.extend([(b - a).cross(&(c - a)); 3]);
            mesh.triangles.push([first, first + 1, first + 2]);
        }
        mesh
    }

    /// A mesh with its triangles shaded flat, or smoothly where there are too many.
    pub fn of(mesh: &crate::geometry::TriangleMesh) -> Self {
        if mesh.triangles().len() <= SHADED_FLAT {
            return Self::flat((0..mesh.triangles().len()).map(|face| mesh.corners(face)));
        }
        Self {
            points: mesh.vertices().to_vec(),
            normals: mesh.vertex_normals().iter().map(|n| n.into_inner()).collect(),
            triangles: mesh.triangles().to_vec(),
        }
    }

    /// A box along the axes.
    pub fn cuboid(low: &Point, high: &Point) -> Self {
        let corner = |k: usize| {
            let side = |axis: usize| if k >> axis & 1 == 0 { low[axis] } else { high[axis] };
            Point::new(side(0), side(1), side(2))
        };
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        Self::flat(quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).map(|t| t.map(corner)))
    }

    /// A cylinder from the middle of one end along a unit axis.
    pub fn cylinder(base: &Point, axis: &Vector, radius: f64, length: f64) -> Self {
        let u = axis.cross(&Vector::ith(axis.iamin(), 1.0)).normalize();
        let v = axis.cross(&u);
        let out = |k: usize| {
            let around = std::f64::consts::TAU * k as f64 / AROUND as f64;
            u * around.cos() + v * around.sin()
        };
        let ends = [*base, base + axis * length];
        let mut mesh = Self::flat((0..AROUND).flat_map(|k| {
            let [low, high] = ends.map(|end| [out(k), out(k + 1)].map(|out| end + out * radius));
            [[ends[0], low[1], low[0]], [ends[1], high[0], high[1]]]
        }));
        for k in 0..AROUND {
            let first = mesh.points.len() as u32;
            let sides = [k, k + 1].map(out);
            mesh.points.extend(ends.iter().flat_map(|end| sides.map(|out| end + out * radius)));
            mesh.normals.extend([sides, sides].concat());
            mesh.triangles.extend([[first, first + 1, first + 3], [first, first + 3, first + 2]]);
        }
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::TriangleMesh;

    /// Joined at equal corners, a drawn body is closed, outward, and of the right size.
    fn volume(mesh: &Mesh) -> f64 {
        let mut points: Vec<Point> = Vec::new();
        let mut number = |p: &Point| {
            points.iter().position(|q| (p - q).norm() < 1e-9).unwrap_or_else(|| {
                points.push(*p);
                points.len() - 1
            }) as u32
        };
        let triangles = mesh.triangles.iter().map(|t| t.map(|k| number(&mesh.points[k as usize]))).collect();
        let joined = TriangleMesh::new(points, triangles).unwrap();
        assert!(joined.topology().is_closed());
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|k| mesh.points[k as usize]);
            assert!((b - a).cross(&(c - a)).dot(&mesh.normals[t[0] as usize]) > 0.0);
        }
        joined.signed_volume()
    }

    #[test]
    fn drawn_bodies_are_closed_and_outward() {
        let cuboid = Mesh::cuboid(&Point::new(1.0, 2.0, 3.0), &Point::new(3.0, 5.0, 7.0));
        assert!((volume(&cuboid) - 24.0).abs() < 1e-9);
        let cylinder = Mesh::cylinder(&Point::new(1.0, 2.0, 3.0), &Vector::new(0.0, 0.6, 0.8), 5.0, 10.0);
        let disc = 0.5 * AROUND as f64 * 25.0 * (std::f64::consts::TAU / AROUND as f64).sin();
        assert!((volume(&cylinder) - 10.0 * disc).abs() < 1e-9);
    }
}
