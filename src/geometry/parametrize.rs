//! Maps a mesh that is one disc onto the unit square. Uses `mesh`, `mesh_topology`.
//!
//! Sources: Floater 2003, Mean value coordinates (weights, positive, so that no triangle turns over when the boundary is
//! convex); Tutte 1963.

use super::mesh::TriangleMesh;
use super::{Point, Vector};
use faer::Mat;
use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};

/// Why a mesh cannot be mapped.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParametrizeError {
    /// Several pieces.
    #[error("the mesh falls into {0} separate pieces")]
    Pieces(usize),
    /// No boundary.
    #[error("the mesh is closed")]
    Closed,
    /// Holes, or a handle.
    #[error("the mesh has {loops} boundary loops and Euler characteristic {euler}; one loop and 1 make a disc")]
    NotADisc {
        /// Boundary loops.
        loops: usize,
        /// Vertices - edges + triangles.
        euler: isize,
    },
    /// A triangle has no room for four corners.
    #[error("the boundary has {0} vertices; at least 4 are needed")]
    FewBoundaryVertices(usize),
    /// The linear system broke down.
    #[error("the mesh cannot be flattened; its triangles are too thin")]
    Singular,
}

/// Where on the unit square each vertex lies.
#[derive(Clone, Debug)]
pub struct SquareMap {
    /// (u, v) of each vertex.
    pub parameters: Vec<[f64; 2]>,
    /// Vertices at (0, 0), (1, 0), (1, 1), (0, 1).
    pub corners: [u32; 4],
    /// Vertices of the boundary.
    pub boundary: Vec<u32>,
    /// Mean length of the two sides along u, and along v, mm.
    pub side_lengths: [f64; 2],
}

/// Share of the boundary's length over which its turning is gathered when corners are looked for.
const CORNER_WINDOW: f64 = 0.01;
/// Share of the boundary's length that lies between two corners at least.
const CORNER_DISTANCE: f64 = 0.015;

/// Maps the mesh so that its normal is the direction of Su × Sv, and u runs along the longer sides. The corners are the
/// four places where the boundary turns most; the boundary is mapped by its length, the inside by mean value coordinates.
pub fn map_to_square(mesh: &TriangleMesh) -> Result<SquareMap, ParametrizeError> {
    let topology = mesh.topology();
    let mut loops = topology.boundary_loops();
    if topology.component_count() != 1 {
        return Err(ParametrizeError::Pieces(topology.component_count()));
    }
    if !topology.is_disc() {
        let (loops, euler) = (loops.len(), topology.euler_characteristic());
        return Err(if loops == 0 { ParametrizeError::Closed } else { ParametrizeError::NotADisc { loops, euler } });
    }
    let boundary = loops.swap_remove(0);
    if boundary.len() < 4 {
        return Err(ParametrizeError::FewBoundaryVertices(boundary.len()));
    }
    let outline = Outline::new(mesh, boundary);
    let mut corners = outline.corners(mesh);
    let mut sides = outline.sides(&corners);
    if sides[1] + sides[3] > sides[0] + sides[2] {
        corners.rotate_left(1);
        sides.rotate_left(1);
    }
    let mut parameters = vec![None; mesh.vertices().len()];
    outline.place(&corners, &mut parameters);
    Ok(SquareMap {
        parameters: inside(mesh, &parameters)?,
        corners: corners.map(|k| outline.vertices[k]),
        side_lengths: [(sides[0] + sides[2]) / 2.0, (sides[1] + sides[3]) / 2.0],
        boundary: outline.vertices,
    })
}

/// The boundary loop with its lengths.
struct Outline {
    vertices: Vec<u32>,
    /// Length from the first vertex up to each, and once around.
    lengths: Vec<f64>,
}

impl Outline {
    fn new(mesh: &TriangleMesh, vertices: Vec<u32>) -> Self {
        let at = |k: usize| mesh.vertices()[vertices[k % vertices.len()] as usize];
        let mut lengths = vec![0.0];
        let mut total = 0.0;
        for k in 0..vertices.len() {
            total += (at(k + 1) - at(k)).norm();
            lengths.push(total);
        }
        Self { vertices, lengths }
    }

    fn count(&self) -> usize {
        self.vertices.len()
    }

    fn total(&self) -> f64 {
        self.lengths[self.count()]
    }

    /// Length along the loop from place `from` forward to place `to`.
    fn forward(&self, from: usize, to: usize) -> f64 {
        let length = self.lengths[to] - self.lengths[from];
        if to > from { length } else { length + self.total() }
    }

    /// Shorter way around between two places.
    fn apart(&self, a: usize, b: usize) -> f64 {
        let length = (self.lengths[a] - self.lengths[b]).abs();
        length.min(self.total() - length)
    }

    /// Places of the four corners in the order of the loop, from the one with the least vertex number on. Turning is
    /// geodesic: 180 degrees less the angles of the triangles at a vertex, gathered over a short window so that a broken
    /// or rounded corner counts as one.
    fn corners(&self, mesh: &TriangleMesh) -> [usize; 4] {
        let mut angles = vec![0.0; mesh.vertices().len()];
        for face in 0..mesh.triangles().len() {
            let corners = mesh.corners(face);
            for (k, vertex) in mesh.triangles()[face].iter().enumerate() {
                angles[*vertex as usize] += angle(&corners[k], &corners[(k + 1) % 3], &corners[(k + 2) % 3]);
            }
        }
        let turning: Vec<f64> = self.vertices.iter().map(|v| std::f64::consts::PI - angles[*v as usize]).collect();
        let window = CORNER_WINDOW * self.total();
        let gathered: Vec<f64> = (0..self.count()).map(|k| self.gathered(&turning, k, window)).collect();
        let mut order: Vec<usize> = (0..self.count()).collect();
        order.sort_by(|a, b| gathered[*b].total_cmp(&gathered[*a]).then(a.cmp(b)));
        let mut found: Vec<usize> = Vec::with_capacity(4);
        for apart in [CORNER_DISTANCE * self.total(), 0.0] {
            for place in &order {
                if found.len() < 4 && found.iter().all(|k| k != place && self.apart(*k, *place) >= apart) {
                    found.push(*place);
                }
            }
        }
        found.sort_unstable();
        let first = (0..found.len()).min_by_key(|k| self.vertices[found[*k]]).unwrap_or(0);
        [0, 1, 2, 3].map(|k| found[(first + k) % found.len()])
    }

    /// Turning within `window` of place `k`, the nearer the more.
    fn gathered(&self, turning: &[f64], k: usize, window: f64) -> f64 {
        let count = self.count();
        let share = |place: usize| (1.0 - self.apart(k, place) / window).max(0.0);
        let forward = (1..count).map(|step| (k + step) % count).take_while(|place| share(*place) > 0.0);
        let backward = (1..count).map(|step| (k + count - step) % count).take_while(|place| share(*place) > 0.0);
        turning[k] + forward.chain(backward).map(|place| turning[place] * share(place)).sum::<f64>()
    }

    fn sides(&self, corners: &[usize; 4]) -> [f64; 4] {
        [0, 1, 2, 3].map(|k| self.forward(corners[k], corners[(k + 1) % 4]))
    }

    /// Lays the loop around the square by length.
    fn place(&self, corners: &[usize; 4], parameters: &mut [Option<[f64; 2]>]) {
        let sides = self.sides(corners);
        for side in 0..4 {
            let mut place = corners[side];
            while place != corners[(side + 1) % 4] {
                let share = if place == corners[side] { 0.0 } else { self.forward(corners[side], place) / sides[side] };
                parameters[self.vertices[place] as usize] = Some(match side {
                    0 => [share, 0.0],
                    1 => [1.0, share],
                    2 => [1.0 - share, 1.0],
                    _ => [0.0, 1.0 - share],
                });
                place = (place + 1) % self.count();
            }
        }
    }
}

/// Angle at `at` between the ways to `a` and `b`, radians.
fn angle(at: &Point, a: &Point, b: &Point) -> f64 {
    let (to_a, to_b): (Vector, Vector) = (a - at, b - at);
    to_a.cross(&to_b).norm().atan2(to_a.dot(&to_b))
}

/// Solves for the inner vertices: each is the mean of its neighbours with Floater's weights
/// w(i, j) = (tan(a/2) + tan(b/2)) / |pi - pj|, a and b the angles at i on both sides of the edge to j.
fn inside(mesh: &TriangleMesh, fixed: &[Option<[f64; 2]>]) -> Result<Vec<[f64; 2]>, ParametrizeError> {
    let mut number = vec![0; fixed.len()];
    let mut unknowns = 0;
    for (vertex, place) in fixed.iter().enumerate() {
        if place.is_none() {
            number[vertex] = unknowns;
            unknowns += 1;
        }
    }
    let mut triplets = Vec::new();
    let mut right = Mat::<f64>::zeros(unknowns, 2);
    for (face, triangle) in mesh.triangles().iter().enumerate() {
        let corners = mesh.corners(face);
        for k in 0..3 {
            let i = triangle[k] as usize;
            if fixed[i].is_some() {
                continue;
            }
            let half = (angle(&corners[k], &corners[(k + 1) % 3], &corners[(k + 2) % 3]) / 2.0).tan();
            for other in [(k + 1) % 3, (k + 2) % 3] {
                let j = triangle[other] as usize;
                let weight = half / (corners[k] - corners[other]).norm();
                triplets.push(Triplet::new(number[i], number[i], weight));
                match fixed[j] {
                    None => triplets.push(Triplet::new(number[i], number[j], -weight)),
                    Some([u, v]) => {
                        right[(number[i], 0)] += weight * u;
                        right[(number[i], 1)] += weight * v;
                    }
                }
            }
        }
    }
    if unknowns > 0 {
        let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(unknowns, unknowns, &triplets)
            .map_err(|_| ParametrizeError::Singular)?;
        matrix.sp_lu().map_err(|_| ParametrizeError::Singular)?.solve_in_place(right.as_mut());
    }
    let parameters: Vec<[f64; 2]> = fixed
        .iter()
        .zip(&number)
        .map(|(place, row)| place.unwrap_or_else(|| [right[(*row, 0)], right[(*row, 1)]]))
        .collect();
    let sound = parameters.iter().flatten().all(|x| x.is_finite());
    if sound { Ok(parameters) } else { Err(ParametrizeError::Singular) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::RigidMotion;

    /// A rectangle grid mesh over x in 0..3, y in 0..2, moved by `place`.
    fn sheet(rows: usize, columns: usize, place: impl Fn(f64, f64) -> Point) -> TriangleMesh {
        let mut points = Vec::new();
        let mut triangles = Vec::new();
        for i in 0..rows {
            for j in 0..columns {
                points.push(place(3.0 * i as f64 / (rows - 1) as f64, 2.0 * j as f64 / (columns - 1) as f64));
                if i > 0 && j > 0 {
                    let (a, b) = (((i - 1) * columns + j - 1) as u32, (i * columns + j - 1) as u32);
                    triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
                }
            }
        }
        TriangleMesh::new(points, triangles).unwrap()
    }

    #[test]
    fn a_flat_rectangle_comes_out_straight_wherever_it_lies() {
        let motion = RigidMotion::new(Vector::new(5.0, 6.0, 7.0), Vector::new(0.4, -0.9, 1.3));
        let mesh =
            sheet(9, 6, |x, y| motion * Point::new(x + 0.1 * (3.0 * x).sin() * y * (2.0 - y) * x * (3.0 - x), y, 0.0));
        let map = map_to_square(&mesh).unwrap();
        assert_eq!(map.corners, [0, 48, 53, 5]);
        for (p, [u, v]) in mesh.vertices().iter().zip(&map.parameters) {
            // Mean value coordinates reproduce linear maps.
            let flat = motion.inverse() * p;
            assert!((flat.x / 3.0 - u).abs() < 1e-9 && (flat.y / 2.0 - v).abs() < 1e-9, "{flat} {u} {v}");
        }
        assert!((map.side_lengths[0] - 3.0).abs() < 1e-12 && (map.side_lengths[1] - 2.0).abs() < 1e-12);
    }

    #[test]
    fn the_four_corners_of_a_narrow_strip_are_found() {
        // Sides 1 : 30, with the long ones bent and one corner blunt.
        let mesh = sheet(60, 5, |x, y| Point::new(20.0 * x + y * (x / 3.0).powi(8), y + 4.0 * x.sin(), 0.3 * x * y));
        assert_eq!(map_to_square(&mesh).unwrap().corners, [0, 295, 299, 4]);
    }

    #[test]
    fn no_triangle_turns_over_on_a_curved_part() {
        let mesh =
            sheet(20, 15, |x, y| Point::new(x.sin() * (1.0 + 0.3 * y), x.cos() * (1.0 + 0.3 * y), y + 0.2 * x * y));
        let map = map_to_square(&mesh).unwrap();
        for triangle in mesh.triangles() {
            let [a, b, c] = triangle.map(|v| map.parameters[v as usize]);
            assert!((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0);
        }
    }

    #[test]
    fn what_is_no_disc_is_refused_by_kind() {
        let ring = sheet(13, 4, |x, y| {
            let angle = (x / 3.0 * 11.0 / 12.0) * std::f64::consts::TAU;
            Point::new((1.0 + y) * angle.cos(), (1.0 + y) * angle.sin(), 0.0)
        });
        // Close the ring by joining its last row to its first.
        let (mut points, mut triangles) = (ring.vertices().to_vec(), ring.triangles().to_vec());
        points.truncate(48);
        triangles.retain(|t| t.iter().all(|v| *v < 48));
        for j in 0..3u32 {
            triangles.extend([[44 + j, j, j + 1], [44 + j, j + 1, 45 + j]]);
        }
        let ring = TriangleMesh::new(points, triangles).unwrap();
        assert!(matches!(map_to_square(&ring), Err(ParametrizeError::NotADisc { loops: 2, euler: 0 })));
        let single = vec![Point::origin(), Point::new(1.0, 0.0, 0.0), Point::new(0.0, 1.0, 0.0)];
        let single = TriangleMesh::new(single, vec![[0, 1, 2]]).unwrap();
        assert_eq!(map_to_square(&single).unwrap_err(), ParametrizeError::FewBoundaryVertices(3));
    }
}
