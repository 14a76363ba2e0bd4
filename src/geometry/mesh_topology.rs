//! How the triangles of a mesh hang together: neighbours, boundary loops, components.

use super::Point;
use super::mesh_error::MeshError;

/// Edge `edge` of triangle `face`; it runs from corner `edge` to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshEdge {
    /// The triangle.
    pub face: usize,
    /// 0, 1 or 2.
    pub edge: usize,
}

/// Adjacency of a manifold, consistently oriented mesh.
#[derive(Clone, Debug)]
pub struct MeshTopology {
    /// The triangle across each edge.
    neighbours: Vec<[Option<u32>; 3]>,
    /// (vertex, edge): the boundary edges at each vertex, sorted by vertex; each edge stands at both its ends.
    boundary: Vec<(u32, MeshEdge)>,
    /// Component of each triangle, numbered by their first triangles.
    components: Vec<u32>,
    vertices: usize,
    edges: usize,
    triangles: Vec<[u32; 3]>,
}

/// One side of one triangle: its ends sorted, and which side of which triangle it is.
struct Side {
    ends: (u32, u32),
    reversed: bool,
    edge: MeshEdge,
}

impl MeshTopology {
    /// Finds neighbours; refuses edges with three triangles and neighbours oriented against each other.
    pub(super) fn new(vertices: &[Point], triangles: &[[u32; 3]]) -> Result<Self, MeshError> {
        let mut sides: Vec<Side> = Vec::with_capacity(triangles.len() * 3);
        for (face, corners) in triangles.iter().enumerate() {
            for edge in 0..3 {
                let (from, to) = (corners[edge], corners[(edge + 1) % 3]);
                sides.push(Side {
                    ends: (from.min(to), from.max(to)),
                    reversed: from > to,
                    edge: MeshEdge { face, edge },
                });
            }
        }
        sides.sort_by_key(|side| (side.ends, side.edge.face, side.edge.edge));
        let mut neighbours = vec![[None; 3]; triangles.len()];
        let mut boundary = Vec::new();
        let mut edges = 0;
        for group in sides.chunk_by(|a, b| a.ends == b.ends) {
            edges += 1;
            let (low, high) = group[0].ends;
            let (from, to) = (vertices[low as usize], vertices[high as usize]);
            match group {
                [one] => boundary.extend([(low, one.edge), (high, one.edge)]),
                [one, other] => {
                    if one.reversed == other.reversed {
                        let (first, second) = (one.edge.face, other.edge.face);
                        return Err(MeshError::Orientation { first, second, at: from });
                    }
                    neighbours[one.edge.face][one.edge.edge] = Some(other.edge.face as u32);
                    neighbours[other.edge.face][other.edge.edge] = Some(one.edge.face as u32);
                }
                more => return Err(MeshError::NonManifold { count: more.len(), from, to }),
            }
        }
        boundary.sort_by_key(|(vertex, edge)| (*vertex, edge.face, edge.edge));
        let components = components(&neighbours);
        Ok(Self { neighbours, boundary, components, vertices: vertices.len(), edges, triangles: triangles.to_vec() })
    }

    /// The triangles across the three edges of `face`; none at the boundary.
    pub fn neighbours(&self, face: usize) -> [Option<usize>; 3] {
        self.neighbours[face].map(|n| n.map(|f| f as usize))
    }

    /// Boundary edges that start or end at `vertex`.
    pub fn boundary_at(&self, vertex: usize) -> impl Iterator<Item = MeshEdge> {
        let start = self.boundary.partition_point(|(v, _)| (*v as usize) < vertex);
        self.boundary[start..].iter().take_while(move |(v, _)| *v as usize == vertex).map(|(_, edge)| *edge)
    }

    /// No boundary.
    pub fn is_closed(&self) -> bool {
        self.boundary.is_empty()
    }

    /// Number of connected components.
    pub fn component_count(&self) -> usize {
        self.components.iter().max().map_or(0, |last| *last as usize + 1)
    }

    /// The first triangle of each connected component.
    pub fn first_of_components(&self) -> Vec<usize> {
        (0..self.component_count() as u32).filter_map(|c| self.components.iter().position(|own| *own == c)).collect()
    }

    /// Vertices - edges + triangles: 1 for a disc, 2 for a sphere.
    pub fn euler_characteristic(&self) -> isize {
        self.vertices as isize - self.edges as isize + self.neighbours.len() as isize
    }

    /// Boundary loops as vertices in the direction of the triangles (material on the left, seen from outside). Where
    /// several loops touch in one vertex, they are told apart in the order of the triangles.
    pub fn boundary_loops(&self) -> Vec<Vec<u32>> {
        let start = |edge: MeshEdge| self.triangles[edge.face][edge.edge];
        let end = |edge: MeshEdge| self.triangles[edge.face][(edge.edge + 1) % 3];
        // Each edge once, sorted by its start.
        let mut edges: Vec<MeshEdge> =
            self.boundary.iter().filter(|(vertex, edge)| *vertex == start(*edge)).map(|(_, edge)| *edge).collect();
        edges.sort_by_key(|edge| (start(*edge), edge.face));
        let mut used = vec![false; edges.len()];
        let mut loops = Vec::new();
        for first in 0..edges.len() {
            if used[first] {
                continue;
            }
            let mut cycle = Vec::new();
            let mut next = Some(first);
            while let Some(index) = next {
                used[index] = true;
                cycle.push(start(edges[index]));
                let vertex = end(edges[index]);
                let low = edges.partition_point(|edge| start(*edge) < vertex);
                next = (low..edges.len()).take_while(|i| start(edges[*i]) == vertex).find(|i| !used[*i]);
            }
            loops.push(cycle);
        }
        loops
    }

    /// One piece with one boundary loop and no handle.
    pub fn is_disc(&self) -> bool {
        self.component_count() == 1 && self.boundary_loops().len() == 1 && self.euler_characteristic() == 1
    }
}

fn components(neighbours: &[[Option<u32>; 3]]) -> Vec<u32> {
    const NONE: u32 = u32::MAX;
    let mut number = vec![NONE; neighbours.len()];
    let mut count = 0;
    for seed in 0..neighbours.len() {
        if number[seed] != NONE {
            continue;
        }
        let mut open = vec![seed];
        number[seed] = count;
        while let Some(face) = open.pop() {
            for next in neighbours[face].into_iter().flatten() {
                if number[next as usize] == NONE {
                    number[next as usize] = count;
                    open.push(next as usize);
                }
            }
        }
        count += 1;
    }
    number
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::TriangleMesh;

    fn mesh(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<TriangleMesh, MeshError> {
        TriangleMesh::new(points.iter().map(|p| Point::from(*p)).collect(), triangles.to_vec())
    }

    const SQUARE: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn a_square_is_a_disc_with_one_loop() {
        let square = mesh(&SQUARE, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        let topology = square.topology();
        assert_eq!(topology.boundary_loops(), vec![vec![0, 1, 2, 3]]);
        assert!(topology.is_disc() && !topology.is_closed());
        assert_eq!(topology.neighbours(0), [None, None, Some(1)]);
    }

    #[test]
    fn a_tetrahedron_is_closed_and_has_no_loop() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let body = mesh(&points, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]).unwrap();
        assert!(body.topology().is_closed() && body.topology().boundary_loops().is_empty());
        assert_eq!(body.topology().euler_characteristic(), 2);
        assert!((body.signed_volume() - 1.0 / 6.0).abs() < 1e-15);
    }

    #[test]
    fn two_squares_apart_are_two_components_and_no_disc() {
        let mut points = SQUARE.to_vec();
        points.extend(SQUARE.map(|[x, y, _]| [x, y, 5.0]));
        let two = mesh(&points, &[[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]).unwrap();
        assert_eq!((two.topology().component_count(), two.topology().boundary_loops().len()), (2, 2));
        assert!(!two.topology().is_disc());
    }

    #[test]
    fn triangles_that_touch_in_a_vertex_only_keep_their_loops_apart() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [-1.0, -1.0, 0.0]];
        let bow = mesh(&points, &[[0, 1, 2], [0, 3, 4]]).unwrap();
        let total: usize = bow.topology().boundary_loops().iter().map(Vec::len).sum();
        assert_eq!(total, 6);
        assert!(!bow.topology().is_disc());
    }

    #[test]
    fn bad_meshes_are_refused_by_kind() {
        assert_eq!(mesh(&SQUARE, &[]).unwrap_err(), MeshError::Empty);
        assert!(matches!(
            mesh(&SQUARE, &[[0, 1, 2], [0, 3, 2]]).unwrap_err(),
            MeshError::Orientation { first: 0, second: 1, .. }
        ));
        assert!(matches!(mesh(&SQUARE, &[[0, 1, 9]]).unwrap_err(), MeshError::Index { vertex: 9, .. }));
        assert!(matches!(mesh(&SQUARE, &[[0, 1, 1]]).unwrap_err(), MeshError::Degenerate { triangle: 0, .. }));
        let mut points = SQUARE.to_vec();
        points.push([0.5, 0.5, 1.0]);
        assert!(matches!(
            mesh(&points, &[[0, 1, 2], [2, 3, 0], [0, 2, 4]]).unwrap_err(),
            MeshError::NonManifold { count: 3, .. }
        ));
        points[4] = [f64::NAN, 0.0, 0.0];
        assert_eq!(mesh(&points, &[[0, 1, 2]]).unwrap_err(), MeshError::NotFinite { vertex: 4 });
    }
}
