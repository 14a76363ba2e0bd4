//! Samples of a mesh: its triangles cut until their sides are short enough, neighbours alike.

use super::sample::{OutwardNormal, SampleGrid, SurfacePlace, SurfaceSample};
use crate::geometry::{Direction, TriangleMesh, Vector};
use std::collections::HashMap;

/// A triangle of the grid: its samples and the mesh triangle it is cut from.
#[derive(Clone, Copy)]
struct Piece {
    face: usize,
    corners: [u32; 3],
}

/// Cuts every side longer than `spacing` at its middle, again and again. Sides are cut whole, so neighbours agree.
pub(super) fn sample(mesh: &TriangleMesh, spacing: f64) -> SampleGrid {
    let mut samples = vec![None; mesh.vertices().len()];
    for (face, corners) in mesh.triangles().iter().enumerate() {
        for (k, vertex) in corners.iter().enumerate() {
            let mut barycentric = [0.0; 3];
            barycentric[k] = 1.0;
            samples[*vertex as usize].get_or_insert_with(|| at(mesh, face, barycentric));
        }
    }
    // A checked mesh has no vertex without a triangle.
    let mut samples: Vec<SurfaceSample> = samples.into_iter().flatten().collect();
    let mut pieces: Vec<Piece> =
        mesh.triangles().iter().enumerate().map(|(face, corners)| Piece { face, corners: *corners }).collect();
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
    mesh: &TriangleMesh,
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
        let sample = in_face(mesh, face, [&first, &second, &second], [0.5, 0.5, 0.0]);
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

fn at(mesh: &TriangleMesh, index: usize, barycentric: [f64; 3]) -> SurfaceSample {
    SurfaceSample {
        point: mesh.point(index, barycentric),
        normal: OutwardNormal(mesh.normal(index, barycentric)),
        place: SurfacePlace::Face { index, barycentric },
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
