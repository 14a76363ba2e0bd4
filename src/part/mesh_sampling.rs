//! Samples of a mesh of flat or curved triangles: its triangles cut until their sides are short enough, neighbours alike.

use super::sample::{OutwardNormal, SampleGrid, SurfacePlace, SurfaceSample};
use crate::geometry::{Barycentric, CurvedMesh, Direction, TriangleMesh, Vector};
use std::collections::HashMap;

/// Triangles whose corners are samples, shared by neighbours.
pub(super) trait Facets {
    /// Numbers of the samples at the corners of each triangle, from 0 without gaps.
    fn corners(&self) -> Vec<[u32; 3]>;
    /// The sample of a triangle with weights of its corners.
    fn at(&self, face: usize, weights: Barycentric) -> SurfaceSample;
    /// The sample in the middle between two of a triangle.
    fn middle(&self, face: usize, ends: [&SurfaceSample; 2]) -> SurfaceSample;
}

impl Facets for TriangleMesh {
    fn corners(&self) -> Vec<[u32; 3]> {
        self.triangles().to_vec()
    }

    fn at(&self, index: usize, barycentric: Barycentric) -> SurfaceSample {
        SurfaceSample {
            point: self.point(index, barycentric),
            normal: OutwardNormal(self.normal(index, barycentric)),
            place: SurfacePlace::Face { index, barycentric },
        }
    }

    fn middle(&self, face: usize, [a, b]: [&SurfaceSample; 2]) -> SurfaceSample {
        in_face(self, face, [a, b, b], [0.5, 0.5, 0.0])
    }
}

/// A curved mesh as it is: along a crease either side has samples of its own, with its own normals.
impl Facets for CurvedMesh {
    fn corners(&self) -> Vec<[u32; 3]> {
        let faces = 0..self.chords().triangles().len();
        faces.map(|face| [0, 1, 2].map(|k| self.corner_normals().number(face, k))).collect()
    }

    fn at(&self, index: usize, barycentric: Barycentric) -> SurfaceSample {
        SurfaceSample {
            point: self.point(index, &barycentric),
            normal: OutwardNormal(self.normal(index, &barycentric)),
            place: SurfacePlace::Face { index, barycentric },
        }
    }

    fn middle(&self, face: usize, ends: [&SurfaceSample; 2]) -> SurfaceSample {
        let [a, b] = ends.map(|sample| {
            let (from, w) = place_on(self, sample);
            self.weights_in(face, from, &w)
        });
        self.at(face, std::array::from_fn(|k| 0.5 * (a[k] + b[k])))
    }
}

/// A curved mesh whose sides share their samples along creases, too.
pub(super) struct Joined<'a>(pub(super) &'a CurvedMesh);

impl Facets for Joined<'_> {
    fn corners(&self) -> Vec<[u32; 3]> {
        self.0.chords().triangles().to_vec()
    }

    fn at(&self, face: usize, weights: Barycentric) -> SurfaceSample {
        self.0.at(face, weights)
    }

    fn middle(&self, face: usize, ends: [&SurfaceSample; 2]) -> SurfaceSample {
        self.0.middle(face, ends)
    }
}

/// A triangle of the grid: its samples and the mesh triangle it is cut from.
#[derive(Clone, Copy)]
struct Piece {
    face: usize,
    corners: [u32; 3],
}

/// Cuts every side longer than `spacing` at its middle, again and again. Sides are cut whole, so neighbours agree.
pub(super) fn sample(mesh: &impl Facets, spacing: f64) -> SampleGrid {
    let triangles = mesh.corners();
    let count = triangles.iter().flatten().max().map_or(0, |last| *last as usize + 1);
    let mut samples = vec![None; count];
    for (face, corners) in triangles.iter().enumerate() {
        for (k, vertex) in corners.iter().enumerate() {
            let mut barycentric = [0.0; 3];
            barycentric[k] = 1.0;
            samples[*vertex as usize].get_or_insert_with(|| mesh.at(face, barycentric));
        }
    }
    // A checked mesh has no vertex without a triangle.
    let mut samples: Vec<SurfaceSample> = samples.into_iter().flatten().collect();
    let mut pieces: Vec<Piece> =
        triangles.iter().enumerate().map(|(face, corners)| Piece { face, corners: *corners }).collect();
    loop {
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut next = Vec::with_capacity(pieces.len() * 2);
        for piece in &pieces {
            let cuts = [0, 1, 2].map(|k| {
                let (a, b) = (piece.corners[k], piece.corners[(k + 1) % 3]);
                middle(mesh, piece.face, &mut samples, &mut middles, (a, b), spacing)
            });
            split(piece, cuts, &mut next);
        }
        pieces = next;
        if middles.is_empty() {
            break;
        }
    }
    SampleGrid { samples, triangles: pieces.iter().map(|piece| piece.corners).collect() }
}

/// The sample in the middle of a side that is too long; the same for both triangles at it.
fn middle(
    mesh: &impl Facets,
    face: usize,
    samples: &mut Vec<SurfaceSample>,
    middles: &mut HashMap<(u32, u32), u32>,
    (a, b): (u32, u32),
    spacing: f64,
) -> Option<u32> {
    let (first, second) = (samples[a as usize], samples[b as usize]);
    if (first.point - second.point).norm() <= spacing {
        return None;
    }
    let key = (a.min(b), a.max(b));
    Some(*middles.entry(key).or_insert_with(|| {
        let sample = mesh.middle(face, [&first, &second]);
        samples.push(sample);
        samples.len() as u32 - 1
    }))
}

/// One to four triangles, turning as before.
fn split(piece: &Piece, cuts: [Option<u32>; 3], pieces: &mut Vec<Piece>) {
    let mut push = |corners: [u32; 3]| pieces.push(Piece { face: piece.face, corners });
    // Turn the triangle so that a cut side comes first, and with two cut sides the uncut one last.
    let turn = match cuts {
        [None, None, None] => return push(piece.corners),
        [Some(_), Some(_), _] | [Some(_), None, None] => 0,
        [_, Some(_), _] => 1,
        [_, None, Some(_)] => 2,
    };
    let [a, b, c] = [0, 1, 2].map(|k| piece.corners[(k + turn) % 3]);
    match [0, 1, 2].map(|k| cuts[(k + turn) % 3]) {
        [Some(ab), Some(bc), Some(ca)] => {
            push([a, ab, ca]);
            push([ab, b, bc]);
            push([ca, bc, c]);
            push([ab, bc, ca]);
        }
        [Some(ab), Some(bc), None] => {
            push([ab, b, bc]);
            push([a, ab, bc]);
            push([a, bc, c]);
        }
        [Some(ab), _, _] => {
            push([a, ab, c]);
            push([ab, b, c]);
        }
        _ => push([a, b, c]),
    }
}

/// The point of a triangle of the grid. Its corners lie in one face, so their weighted mean does; the face is known
/// from their places, or looked up when they name different faces that share an edge.
pub(super) fn between(mesh: &TriangleMesh, corners: [&SurfaceSample; 3], weights: [f64; 3]) -> SurfaceSample {
    let mut point = Vector::zeros();
    for (corner, weight) in corners.iter().zip(weights) {
        point += corner.point.coords * weight;
    }
    let faces = corners.map(|corner| match corner.place {
        SurfacePlace::Face { index, .. } => Some(index),
        SurfacePlace::Parameters { .. } => None,
    });
    let face = match faces {
        [Some(a), Some(b), Some(c)] if a == b && b == c => a,
        _ => mesh.closest(&point.into()).face,
    };
    in_face(mesh, face, corners, weights)
}

/// The exact point of a curved mesh between samples of one of its triangles.
pub(super) fn between_curved(mesh: &CurvedMesh, corners: [&SurfaceSample; 3], weights: [f64; 3]) -> SurfaceSample {
    let (face, places) = mesh.together(corners.map(|corner| place_on(mesh, corner)));
    mesh.at(face, std::array::from_fn(|k| (0..3).map(|i| weights[i] * places[i][k]).sum()))
}

/// Where a sample lies on a curved mesh; one of another surface is brought onto it.
pub(super) fn place_on(mesh: &CurvedMesh, sample: &SurfaceSample) -> (usize, Barycentric) {
    match sample.place {
        SurfacePlace::Face { index, barycentric } => (index, barycentric),
        SurfacePlace::Parameters { .. } => {
            let foot = mesh.closest(&sample.point);
            (foot.face, foot.barycentric)
        }
    }
}

/// Weighted mean of samples that lie in `face`: point, and the normal as interpolated in that face.
fn in_face(mesh: &TriangleMesh, face: usize, corners: [&SurfaceSample; 3], weights: [f64; 3]) -> SurfaceSample {
    let mut point = Vector::zeros();
    let mut normal = Vector::zeros();
    for (corner, weight) in corners.iter().zip(weights) {
        point += corner.point.coords * weight;
        normal += corner.normal.0.into_inner() * weight;
    }
    let normal = Direction::try_new(normal, 1e-9).unwrap_or(mesh.face_normals()[face]);
    SurfaceSample {
        point: point.into(),
        normal: OutwardNormal(normal),
        place: SurfacePlace::Face { index: face, barycentric: mesh.barycentric(face, &point.into()) },
    }
}

#[cfg(test)]
#[path = "mesh_sampling_tests.rs"]
mod tests;
