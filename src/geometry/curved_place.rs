//! Closest points on curved meshes, the same place seen from another triangle, and guaranteed bounds over parts of a
//! patch. Uses `curved_mesh` and `mesh`.

use super::bezier_triangle::{Barycentric, CubicTriangle};
use super::curved_mesh::CurvedMesh;
use super::mesh::{MeshFeature, MeshFoot, OnTriangle};
use super::mesh_topology::MeshEdge;
use super::{Point, Vector};

/// Share of the mesh's size by which a foot may be farther than the closest point.
const CLOSE: f64 = 1e-9;
/// Parts of patches that the search for one foot takes apart at most; beyond that, near the middle of a sphere, one of
/// many places equally near is as good as another.
const MOST_PARTS: usize = 4000;
/// Steps of Newton's method at the end.
const STEPS: usize = 8;
/// Share of (mesh size + distance) within which a point counts as above the boundary and not beyond it.
const BEYOND: f64 = 1e-9;

/// How far a part of a patch leaves the flat triangle between its corners, and how far its normals turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchBounds {
    /// No point of the part is farther from the flat triangle's point of the same weights, mm.
    pub bulge: f64,
    /// No unit normal of the part differs more from the one asked about, as the length of the difference.
    pub turn: f64,
}

/// A part of a patch in the search for a foot.
#[derive(Clone, Copy)]
struct Part {
    face: usize,
    corners: [Barycentric; 3],
    points: CubicTriangle,
    bulge: f64,
}

/// The best place so far.
struct Best {
    face: usize,
    w: Barycentric,
    distance: f64,
}

fn weighted(corners: &[Barycentric; 3], w: &Barycentric) -> Barycentric {
    std::array::from_fn(|k| (0..3).map(|i| w[i] * corners[i][k]).sum())
}

impl Part {
    fn whole(mesh: &CurvedMesh, face: usize) -> Self {
        let points = mesh.patches[face].points;
        let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Self { face, corners, points, bulge: points.bulge() }
    }

    fn quarters(&self) -> [Self; 4] {
        CubicTriangle::quarters().map(|quarter| {
            let points = self.points.part(&quarter);
            let corners = quarter.map(|w| weighted(&self.corners, &w));
            Self { face: self.face, corners, points, bulge: points.bulge() }
        })
    }

    /// Takes the place over the nearest point of the flat triangle where that is better; returns what no point of the part
    /// is nearer than.
    fn look(&self, p: &Point, best: &mut Best) -> f64 {
        let [a, b, c, ..] = self.points.0.map(Point::from);
        let flat = OnTriangle::nearest(&[a, b, c], p);
        let distance = (self.points.at(&flat.barycentric) - p.coords).norm();
        if distance < best.distance {
            *best = Best { face: self.face, w: weighted(&self.corners, &flat.barycentric), distance };
        }
        (flat.point - p).norm() - self.bulge
    }
}

impl CurvedMesh {
    /// The closest point and on which side `p` lies, by the normals of all patches that meet there.
    pub fn closest(&self, p: &Point) -> MeshFoot {
        let close = CLOSE * self.size();
        let mut best = Best { face: 0, w: [1.0, 0.0, 0.0], distance: f64::INFINITY };
        let (mut open, mut spent) = (Vec::new(), 0);
        self.tree.nearest(p, f64::INFINITY, |face, _| {
            let whole = Part::whole(self, face);
            let least = whole.look(p, &mut best);
            open.push((least, whole));
            while let Some((least, part)) = open.pop() {
                if least >= best.distance - close || spent == MOST_PARTS {
                    continue;
                }
                spent += 1;
                let mut quarters = part.quarters().map(|quarter| (quarter.look(p, &mut best), quarter));
                quarters.sort_by(|(a, _), (b, _)| b.total_cmp(a));
                open.extend(quarters);
            }
            best.distance * best.distance
        });
        let w = self.polished(&best, p);
        self.foot(best.face, w, p)
    }

    /// The stationary place near one, on the same side or in the same inside, where that is nearer.
    fn polished(&self, best: &Best, p: &Point) -> Barycentric {
        let patch = &self.patches[best.face].points;
        let ways: Vec<[f64; 2]> = match best.w.map(|x| x == 0.0) {
            [false, false, false] => vec![[1.0, 0.0], [0.0, 1.0]],
            [true, false, false] => vec![[-1.0, 1.0]],
            [false, true, false] => vec![[0.0, 1.0]],
            [false, false, true] => vec![[1.0, 0.0]],
            _ => return best.w,
        };
        let moved = |w: &Barycentric, by: [f64; 2]| [w[0] - by[0] - by[1], w[1] + by[0], w[2] + by[1]];
        let mut w = best.w;
        for _ in 0..STEPS {
            let step = newton(patch, &w, p, &ways);
            let next = moved(&w, step);
            if next.iter().zip(&best.w).any(|(x, before)| *x < 0.0 || (*x == 0.0) != (*before == 0.0)) {
                break;
            }
            w = next;
        }
        if (patch.at(&w) - p.coords).norm() < best.distance { w } else { best.w }
    }

    fn foot(&self, face: usize, w: Barycentric, p: &Point) -> MeshFoot {
        let point = self.point(face, &w);
        let offset = p - point;
        let feature = match w.map(|x| x == 0.0) {
            [false, true, true] => MeshFeature::Vertex(0),
            [true, false, true] => MeshFeature::Vertex(1),
            [true, true, false] => MeshFeature::Vertex(2),
            [false, false, true] => MeshFeature::Edge(0),
            [true, false, false] => MeshFeature::Edge(1),
            [false, true, false] => MeshFeature::Edge(2),
            _ => MeshFeature::Face,
        };
        let side = offset.dot(&self.pseudonormal(face, &w, feature));
        let past_edge = self.past_edge(face, &w, feature, &offset);
        let signed_distance = offset.norm().copysign(side);
        MeshFoot { face, barycentric: w, point, signed_distance, feature, past_edge }
    }

    fn pseudonormal(&self, face: usize, w: &Barycentric, feature: MeshFeature) -> Vector {
        let own = self.normal(face, w).into_inner();
        match feature {
            MeshFeature::Face => own,
            MeshFeature::Edge(k) => {
                let other = self.chords.topology().neighbours(face)[k];
                let beyond = other.and_then(|other| Some(self.normal(other, &self.seen_from(other, face, w)?)));
                own + beyond.map_or(Vector::zeros(), |n| n.into_inner())
            }
            MeshFeature::Vertex(k) => {
                let vertex = self.chords.triangles()[face][k];
                let number = |face: usize| {
                    let at = self.chords.triangles()[face].iter().position(|v| *v == vertex)?;
                    Some(self.corners.number(face, at))
                };
                let smooth = self.faces_at(vertex).all(|other| number(other) == number(face));
                if smooth { own } else { self.chords.vertex_normals()[vertex as usize].into_inner() }
            }
        }
    }

    fn past_edge(&self, face: usize, w: &Barycentric, feature: MeshFeature, offset: &Vector) -> bool {
        let tolerance = BEYOND * (self.size() + offset.norm());
        let beyond = |edge: MeshEdge, w: &Barycentric| {
            let jet = self.patches[edge.face].points.jet(w);
            let along = [jet.u, jet.v - jet.u, -jet.v][edge.edge];
            let out = along.cross(&self.normal(edge.face, w));
            offset.dot(&out) > tolerance * out.norm()
        };
        match feature {
            MeshFeature::Face => false,
            MeshFeature::Edge(k) => {
                self.chords.topology().neighbours(face)[k].is_none() && beyond(MeshEdge { face, edge: k }, w)
            }
            MeshFeature::Vertex(k) => {
                let vertex = self.chords.triangles()[face][k];
                self.chords.topology().boundary_at(vertex as usize).any(|edge| {
                    let at = self.chords.triangles()[edge.face].map(|v| f64::from(u8::from(v == vertex)));
                    beyond(edge, &at)
                })
            }
        }
    }

    /// The place of a corner or side of triangle `from` as weights in another triangle that has these corners, too.
    fn seen_from(&self, face: usize, from: usize, w: &Barycentric) -> Option<Barycentric> {
        if face == from {
            return Some(*w);
        }
        let triangles = self.chords.triangles();
        let mut seen = [0.0; 3];
        for (vertex, weight) in triangles[from].iter().zip(w).filter(|(_, weight)| **weight != 0.0) {
            seen[triangles[face].iter().position(|v| v == vertex)?] = *weight;
        }
        Some(seen)
    }

    /// The weights of a place of triangle `from` in another: the same place where both have it, else where the other's
    /// polynomial comes nearest to it.
    pub fn weights_in(&self, face: usize, from: usize, w: &Barycentric) -> Barycentric {
        self.seen_from(face, from, w).unwrap_or_else(|| self.carried(face, from, w))
    }

    /// The triangle in which places of several triangles lie, and each place's weights there. Where none has them all, as
    /// for a place drawn over an edge by a little, the one that has most, and weights of its polynomial past its sides.
    pub fn together<const N: usize>(&self, places: [(usize, Barycentric); N]) -> (usize, [Barycentric; N]) {
        let first = places[0].0;
        if places.iter().all(|(face, _)| *face == first) {
            return (first, places.map(|(_, w)| w));
        }
        let has = |face: usize| places.iter().filter(|(from, w)| self.seen_from(face, *from, w).is_some()).count();
        let corners = places.iter().flat_map(|(face, w)| {
            let corners = self.chords.triangles()[*face].into_iter().zip(w);
            corners.filter(|(_, weight)| **weight != 0.0).map(|(vertex, _)| vertex)
        });
        let around = corners.flat_map(|vertex| self.faces_at(vertex));
        let mut chosen = (has(first), first);
        for face in places.iter().map(|(face, _)| *face).chain(around) {
            if chosen.0 == N {
                break;
            }
            let count = has(face);
            if count > chosen.0 {
                chosen = (count, face);
            }
        }
        let face = chosen.1;
        (face, places.map(|(from, w)| self.weights_in(face, from, &w)))
    }

    /// The weights with which the polynomial of one patch comes nearest to a point of another.
    fn carried(&self, face: usize, from: usize, w: &Barycentric) -> Barycentric {
        let point = self.point(from, w);
        let patch = &self.patches[face].points;
        let mut w = self.chords.barycentric(face, &point);
        for _ in 0..STEPS {
            let [u, v] = newton(patch, &w, &point, &[[1.0, 0.0], [0.0, 1.0]]);
            w = [w[0] - u - v, w[1] + u, w[2] + v];
        }
        w
    }

    /// Bounds over the part of a patch between corners given by their weights; `normal` is a unit vector.
    pub fn part_bounds(&self, face: usize, corners: &[Barycentric; 3], normal: &Vector) -> PatchBounds {
        let patch = &self.patches[face];
        let normals = patch.normals.part(corners);
        // Every normal is a mean of the control vectors, but for its length: it lies in any circular cone that holds them.
        let tangent = normals.0.iter().map(|n| {
            let along = n.dot(normal);
            if along > 0.0 { (n - normal * along).norm() / along } else { f64::INFINITY }
        });
        let angle = tangent.fold(0.0, f64::max).atan();
        PatchBounds { bulge: patch.points.part(corners).bulge(), turn: 2.0 * (0.5 * angle).sin() }
    }

    fn size(&self) -> f64 {
        self.chords.scale
    }
}

/// A step of Newton's method toward the place nearest to `p`, along given ways; where the distance does not bend upward,
/// of Gauss and Newton's.
fn newton(patch: &CubicTriangle, w: &Barycentric, p: &Point, ways: &[[f64; 2]]) -> [f64; 2] {
    let jet = patch.jet(w);
    let off = jet.point - p.coords;
    let along = |[a, b]: [f64; 2]| jet.u * a + jet.v * b;
    let bend = |[a, b]: [f64; 2], [c, d]: [f64; 2]| jet.uu * (a * c) + jet.uv * (a * d + b * c) + jet.vv * (b * d);
    match ways {
        [way] => {
            let flat = along(*way).norm_squared();
            let full = flat + off.dot(&bend(*way, *way));
            let step = -off.dot(&along(*way)) / if full > 0.0 { full } else { flat };
            way.map(|x| x * step)
        }
        [first, second, ..] => {
            let entry = |a: [f64; 2], b: [f64; 2]| (along(a).dot(&along(b)), off.dot(&bend(a, b)));
            let entries = [entry(*first, *first), entry(*first, *second), entry(*second, *second)];
            let [a, b, c] = entries.map(|(flat, bent)| flat + bent);
            let upward = a > 0.0 && a * c - b * b > 0.0;
            let [a, b, c] = if upward { [a, b, c] } else { entries.map(|(flat, _)| flat) };
            let determinant = a * c - b * b;
            if determinant.is_nan() || determinant <= 0.0 {
                return [0.0; 2];
            }
            let (f, g) = (off.dot(&along(*first)), off.dot(&along(*second)));
            let (s, t) = ((b * g - c * f) / determinant, (b * f - a * g) / determinant);
            [first[0] * s + second[0] * t, first[1] * s + second[1] * t]
        }
        [] => [0.0; 2],
    }
}

#[cfg(test)]
#[path = "curved_place_tests.rs"]
mod tests;
