//! Normals at the corners of a mesh's triangles: given with the mesh, or found from it with creases kept. Uses `mesh`.
//!
//! Corners at one vertex between which no crease runs share one normal. Where none is given, it is that of a quadratic
//! graph fitted to the edges around, whose middles have the slopes of a quadratic graph exactly; so it is as right at the
//! edge of an open mesh as inside, where a mean of the triangles' normals is off by half the angle between two of them.
//! Where a mesh has too few triangles one behind the other for that, as a strip of them has, the mean is the start, and
//! the normal is settled with its neighbours: those at both ends of a chord sum to a vector square to it on a sphere and
//! around a cylinder or cone.

use super::angle::Radians;
use super::mesh::TriangleMesh;
use super::{Direction, Point, Vector};
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};
use std::f64::consts::FRAC_1_SQRT_2;

/// Normals at corners, shared by the corners of a vertex between which the surface is smooth.
#[derive(Clone, Debug)]
pub struct CornerNormals {
    /// The normal of each corner of each triangle, by its index in `normals`.
    corners: Vec<[u32; 3]>,
    normals: Vec<Direction>,
}

/// Length of the difference of unit normals that are given as equal, but for rounding.
const SAME: f64 = 1e-5;
/// Fits of the graph, each over the plane square to the normal of the one before.
const FITS: usize = 3;
/// Slopes and second derivatives of a quadratic graph.
const TERMS: usize = 5;
/// Edges around that are enough for a graph, and how many rings of triangles they are looked for in.
const ENOUGH: usize = 15;
const MOST_RINGS: usize = 3;
/// Share of the mean eigenvalue of the equations of a graph that the smallest must reach for the edges to tell it.
const TOLD: f64 = 1e-3;
/// Rounds in which normals are settled. Each goes half way to what chords ask for: so errors alike at both ends of chords
/// vanish at once.
const ROUNDS: usize = 12;
/// Chords count by the inverse of how much they ask for, and of this share of the most: the few that end at a neighbour
/// that is not settled yet are outvoted.
const OUTVOTED: f64 = 0.02;
/// Share of the weight of its chords with which a normal is held where they leave it free.
const HELD: f64 = 1e-6;

impl CornerNormals {
    /// Takes normals that come with the mesh, one for each corner of each triangle.
    pub fn given(mesh: &TriangleMesh, normals: &[[Direction; 3]]) -> Self {
        // The corners at each vertex that have been seen: the number of their normal.
        let mut seen: Vec<Vec<u32>> = vec![Vec::new(); mesh.vertices().len()];
        let mut kept: Vec<Direction> = Vec::new();
        let mut number = |vertex: u32, normal: &Direction| {
            let here = &mut seen[vertex as usize];
            let same = |known: &&u32| (kept[**known as usize].into_inner() - normal.into_inner()).norm() < SAME;
            here.iter().find(same).copied().unwrap_or_else(|| {
                kept.push(*normal);
                here.push(kept.len() as u32 - 1);
                kept.len() as u32 - 1
            })
        };
        let corners = mesh.triangles().iter().zip(normals);
        let corners = corners.map(|(t, n)| [0, 1, 2].map(|k| number(t[k], &n[k]))).collect();
        Self { corners, normals: kept }
    }

    /// Finds the normals; an edge whose triangles' normals are farther apart than `crease` is a crease.
    pub fn from_creases(mesh: &TriangleMesh, crease: Radians) -> Self {
        let fans = Fans::new(mesh, crease);
        let means: Vec<Direction> = (0..fans.faces.len()).map(|fan| fans.mean(mesh, fan)).collect();
        // The normals of a smooth surface are within the crease angle of its triangles.
        let fits = |fan: usize, normal: &Direction| {
            fans.faces[fan].iter().all(|(face, _)| normal.angle(&mesh.face_normals()[*face as usize]) < crease.0)
        };
        let graph = |(fan, mean): (usize, &Direction)| fans.graph(mesh, fan, mean).filter(|normal| fits(fan, normal));
        let graphs: Vec<Option<Direction>> = means.iter().enumerate().map(graph).collect();
        let chords: Vec<Vec<Chord>> = (0..means.len())
            .map(|fan| if graphs[fan].is_some() { Vec::new() } else { fans.chords(mesh, fan) })
            .collect();
        let mut normals: Vec<Direction> =
            graphs.iter().zip(&means).map(|(graph, mean)| graph.unwrap_or(*mean)).collect();
        for _ in 0..ROUNDS {
            normals = chords.iter().zip(&normals).map(|(chords, own)| settled(own, chords, &normals)).collect();
        }
        let found = normals.iter().zip(means).enumerate();
        let normals = found.map(|(fan, (normal, mean))| if fits(fan, normal) { *normal } else { mean }).collect();
        Self { corners: fans.of_corner, normals }
    }

    /// Number of the normal at corner `k` of a triangle; equal numbers at one vertex mean a smooth surface between.
    pub fn number(&self, face: usize, k: usize) -> u32 {
        self.corners[face][k]
    }

    /// How many normals there are.
    pub fn count(&self) -> usize {
        self.normals.len()
    }

    /// The normals at the corners of a triangle.
    pub fn of(&self, face: usize) -> [Direction; 3] {
        self.corners[face].map(|number| self.normals[number as usize])
    }

    /// The normals turned.
    #[must_use]
    pub fn transformed(&self, motion: &super::RigidMotion) -> Self {
        Self { corners: self.corners.clone(), normals: self.normals.iter().map(|n| motion * n).collect() }
    }
}

/// The triangles around each vertex, apart where a crease or a boundary parts them.
struct Fans {
    /// The fan of each corner of each triangle.
    of_corner: Vec<[u32; 3]>,
    /// The triangles of each fan, with the corner that lies at its vertex.
    faces: Vec<Vec<(u32, u8)>>,
}

impl Fans {
    fn new(mesh: &TriangleMesh, crease: Radians) -> Self {
        let triangles = mesh.triangles();
        let mut join = DisjointSets::new(3 * triangles.len());
        for (face, corners) in triangles.iter().enumerate() {
            for (k, other) in mesh.topology().neighbours(face).into_iter().enumerate() {
                let Some(other) = other else { continue };
                if mesh.face_normals()[face].angle(&mesh.face_normals()[other]) > crease.0 {
                    continue;
                }
                for end in [k, (k + 1) % 3] {
                    if let Some(there) = triangles[other].iter().position(|v| *v == corners[end]) {
                        join.unite(3 * face + end, 3 * other + there);
                    }
                }
            }
        }
        let mut number = vec![u32::MAX; 3 * triangles.len()];
        let mut faces: Vec<Vec<(u32, u8)>> = Vec::new();
        let of_corner = (0..triangles.len()).map(|face| {
            [0, 1, 2].map(|k| {
                let root = join.root(3 * face + k);
                if number[root] == u32::MAX {
                    number[root] = faces.len() as u32;
                    faces.push(Vec::new());
                }
                faces[number[root] as usize].push((face as u32, k as u8));
                number[root]
            })
        });
        Self { of_corner: of_corner.collect(), faces }
    }

    /// The mean of the normals of a fan's triangles by their angles there.
    fn mean(&self, mesh: &TriangleMesh, fan: usize) -> Direction {
        let mut sum = Vector::zeros();
        let mut first = Vector::z_axis();
        for (face, k) in self.faces[fan].iter().rev().map(|(face, k)| (*face as usize, usize::from(*k))) {
            let corners = mesh.corners(face);
            let [a, b, c] = [0, 1, 2].map(|i| corners[(k + i) % 3]);
            first = mesh.face_normals()[face];
            sum += first.into_inner() * (b - a).angle(&(c - a));
        }
        Direction::try_new(sum, 1e-9).unwrap_or(first)
    }

    /// The normal of the graph fitted to the edges around a fan's vertex; `None` where they do not tell it.
    fn graph(&self, mesh: &TriangleMesh, fan: usize, mean: &Direction) -> Option<Direction> {
        let (face, k) = self.faces[fan].first()?;
        let vertex = mesh.corners(*face as usize)[usize::from(*k)];
        let edges = self.edges_around(mesh, fan);
        let mut normal = *mean;
        for _ in 0..FITS {
            normal = graph_normal(&vertex, &normal, &edges)?;
        }
        Some(normal)
    }

    /// Edges of a fan's triangles, of those of the fans at their corners, and so on until there are enough.
    fn edges_around(&self, mesh: &TriangleMesh, fan: usize) -> Vec<[Point; 2]> {
        let (mut fans, mut edges) = (vec![fan as u32], Vec::new());
        for _ in 0..MOST_RINGS {
            let faces: Vec<u32> =
                fans.iter().flat_map(|fan| &self.faces[*fan as usize]).map(|(face, _)| *face).collect();
            let sides = |face: &u32| {
                let [a, b, c] = mesh.triangles()[*face as usize];
                [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)])
            };
            edges = faces.iter().flat_map(sides).collect::<Vec<_>>();
            edges.sort_unstable();
            edges.dedup();
            if edges.len() >= ENOUGH {
                break;
            }
            fans = faces.iter().flat_map(|face| self.of_corner[*face as usize]).collect();
            fans.sort_unstable();
            fans.dedup();
        }
        edges.iter().map(|ends| ends.map(|v| mesh.vertices()[v as usize])).collect()
    }

    /// The sides of a fan's triangles that start at its vertex, each once.
    fn chords(&self, mesh: &TriangleMesh, fan: usize) -> Vec<Chord> {
        let Some((face, k)) = self.faces[fan].first() else { return Vec::new() };
        let corner = |face: u32, k: usize| mesh.corners(face as usize)[k];
        let from = corner(*face, usize::from(*k));
        let ends = self.faces[fan].iter().flat_map(|(face, k)| [1, 2].map(|i| (*face, (usize::from(*k) + i) % 3)));
        let mut ends: Vec<_> = ends.map(|(face, k)| (self.of_corner[face as usize][k], face, k)).collect();
        ends.sort_unstable();
        ends.dedup_by_key(|(fan, ..)| *fan);
        ends.iter().map(|(fan, face, k)| Chord { fan: *fan, along: (corner(*face, *k) - from).normalize() }).collect()
    }
}

/// The way from one fan's vertex to another's.
struct Chord {
    fan: u32,
    along: Vector,
}

/// Two unit vectors square to a normal and to each other.
fn across(normal: &Direction) -> [Vector; 2] {
    let u = normal.cross(&Vector::ith(normal.iamin(), 1.0)).normalize();
    [u, normal.cross(&u)]
}

/// The normal at a vertex of the quadratic graph over the plane square to `normal` whose slopes in the middles of edges
/// are nearest to those of the edges, weighted by the inverse square of their distances; `None` where these do not tell. The
/// mixed term is scaled so that the terms turn into each other with the plane's axes: which these are then changes nothing.
fn graph_normal(vertex: &Point, normal: &Direction, edges: &[[Point; 2]]) -> Option<Direction> {
    let scale = edges.iter().map(|[a, b]| (b - a).norm()).sum::<f64>() / edges.len() as f64;
    let [u, v] = across(normal);
    let mut square = SMatrix::<f64, TERMS, TERMS>::zeros();
    let mut right = SVector::<f64, TERMS>::zeros();
    for [a, b] in edges {
        let (way, middle) = ((b - a).normalize(), (nalgebra::center(a, b) - vertex) / scale);
        let ([x, y], [p, q]) = ([way.dot(&u), way.dot(&v)], [middle.dot(&u), middle.dot(&v)]);
        let row = SVector::<f64, TERMS>::from([x, y, p * x, (q * x + p * y) * FRAC_1_SQRT_2, q * y]);
        let weight = 1.0 / middle.norm_squared();
        square += row * row.transpose() * weight;
        right += row * (way.dot(normal) * weight);
    }
    let least = square.symmetric_eigenvalues().min();
    if least.is_nan() || least <= TOLD * square.trace() / TERMS as f64 {
        return None;
    }
    let slopes = square.cholesky()?.solve(&right);
    Direction::try_new(normal.into_inner() - u * slopes[0] - v * slopes[1], 1e-9)
}

/// A normal, brought half way to where its sums with those at the ends of its chords are square to them, by least squares.
fn settled(own: &Direction, chords: &[Chord], normals: &[Direction]) -> Direction {
    let asked: Vec<f64> =
        chords.iter().map(|c| c.along.dot(&(own.into_inner() + normals[c.fan as usize].into_inner()))).collect();
    let most = asked.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    if most == 0.0 {
        return *own;
    }
    let [u, v] = across(own);
    let (mut square, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for (Chord { along, .. }, asked) in chords.iter().zip(asked) {
        let row = Vector2::new(along.dot(&u), along.dot(&v));
        let weight = most / (asked.abs() + OUTVOTED * most);
        square += row * row.transpose() * weight + Matrix2::identity() * (HELD * weight);
        right -= row * (weight * asked);
    }
    let Some(inverse) = square.try_inverse() else { return *own };
    let step = inverse * right * 0.5;
    Direction::try_new(own.into_inner() + u * step.x + v * step.y, 1e-9).unwrap_or(*own)
}

/// Sets of numbers that are joined again and again.
struct DisjointSets(Vec<u32>);

impl DisjointSets {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn root(&mut self, of: usize) -> usize {
        let mut at = of;
        while self.0[at] as usize != at {
            self.0[at] = self.0[self.0[at] as usize];
            at = self.0[at] as usize;
        }
        at
    }

    fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b) as u32;
    }
}
