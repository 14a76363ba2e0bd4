//! Axis-aligned boxes and a bounding volume hierarchy over them, shared by spline patches and triangles.

use super::{Point, Vector};

/// An axis-aligned box, mm. Empty when low exceeds high.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Least coordinates.
    pub low: Point,
    /// Greatest coordinates.
    pub high: Point,
}

impl Aabb {
    /// The box that holds nothing.
    pub fn empty() -> Self {
        Self { low: Point::from(Vector::repeat(f64::INFINITY)), high: Point::from(Vector::repeat(f64::NEG_INFINITY)) }
    }

    /// Smallest box around points.
    pub fn around<'a>(points: impl IntoIterator<Item = &'a Point>) -> Self {
        points.into_iter().fold(Self::empty(), |bounds, p| Self { low: bounds.low.inf(p), high: bounds.high.sup(p) })
    }

    /// Smallest box around both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    /// Middle.
    pub fn centre(&self) -> Point {
        nalgebra::center(&self.low, &self.high)
    }

    /// Length of the diagonal, mm; 0 for an empty box.
    pub fn diagonal(&self) -> f64 {
        if self.low.x > self.high.x { 0.0 } else { (self.high - self.low).norm() }
    }

    /// Square of the distance from `p`; 0 inside.
    pub fn distance_squared(&self, p: &Point) -> f64 {
        (self.low - p).sup(&(p - self.high)).sup(&Vector::zeros()).norm_squared()
    }
}

/// Items in a leaf of the hierarchy.
const LEAF_ITEMS: usize = 2;
/// Halving 2^32 items ends in fewer levels than this.
const MAX_DEPTH: usize = 40;

#[derive(Clone, Debug)]
struct Node {
    bounds: Aabb,
    /// Leaf: first place in `items`. Inner node: index of the right child; the left child follows its parent.
    first: u32,
    /// Leaf: number of items. Inner node: 0.
    count: u32,
}

/// A binary tree of boxes over numbered items, halved at the median so that its depth is bounded.
#[derive(Clone, Debug)]
pub struct Bvh {
    nodes: Vec<Node>,
    items: Vec<u32>,
}

impl Bvh {
    /// Builds the tree over the boxes of items 0, 1, 2, …
    pub fn new(boxes: &[Aabb]) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity(boxes.len() * 2), items: (0..boxes.len() as u32).collect() };
        if !boxes.is_empty() {
            let mut items = std::mem::take(&mut tree.items);
            tree.grow(boxes, &mut items, 0);
            tree.items = items;
        }
        tree
    }

    fn grow(&mut self, boxes: &[Aabb], items: &mut [u32], offset: usize) {
        let bounds = items.iter().fold(Aabb::empty(), |sum, i| sum.union(&boxes[*i as usize]));
        let node = self.nodes.len();
        self.nodes.push(Node { bounds, first: offset as u32, count: items.len() as u32 });
        if items.len() <= LEAF_ITEMS {
            return;
        }
        let centre = |i: &u32| boxes[*i as usize].centre();
        let centres = items.iter().fold(Aabb::empty(), |sum, i| sum.union(&Aabb { low: centre(i), high: centre(i) }));
        let axis = (centres.high - centres.low).imax();
        let half = items.len() / 2;
        // Ties are broken by number, so the tree depends on nothing but the boxes.
        items.select_nth_unstable_by(half, |a, b| centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(b)));
        let (left, right) = items.split_at_mut(half);
        self.grow(boxes, left, offset);
        self.nodes[node].first = self.nodes.len() as u32;
        self.nodes[node].count = 0;
        self.grow(boxes, right, offset + half);
    }

    /// Visits items in the order of the tree, nearer boxes first, as long as their box lies within the bound.
    ///
    /// `visit` gets an item and the bound so far (square of a distance) and returns the new bound, not larger.
    pub fn nearest(&self, p: &Point, bound: f64, mut visit: impl FnMut(usize, f64) -> f64) {
        let mut bound = bound;
        let mut stack = [(0u32, 0.0); MAX_DEPTH];
        let mut height = usize::from(!self.nodes.is_empty());
        while height > 0 {
            height -= 1;
            let (mut index, distance) = stack[height];
            if distance >= bound {
                continue;
            }
            loop {
                let node = &self.nodes[index as usize];
                if node.count > 0 {
                    for item in &self.items[node.first as usize..(node.first + node.count) as usize] {
                        bound = visit(*item as usize, bound);
                    }
                    break;
                }
                let (left, right) = (index + 1, node.first);
                let left_distance = self.nodes[left as usize].bounds.distance_squared(p);
                let right_distance = self.nodes[right as usize].bounds.distance_squared(p);
                let (near, far) = if right_distance < left_distance {
                    ((right, right_distance), (left, left_distance))
                } else {
                    ((left, left_distance), (right, right_distance))
                };
                if near.1 >= bound {
                    break;
                }
                if far.1 < bound {
                    stack[height] = far;
                    height += 1;
                }
                index = near.0;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Point> {
        prop::array::uniform3(-10.0..10.0f64).prop_map(|[x, y, z]| Point::new(x, y, z))
    }

    proptest! {
        #[test]
        fn nearest_agrees_with_looking_at_all(points in prop::collection::vec(point(), 1..200), p in point()) {
            let boxes: Vec<Aabb> = points.iter().map(|q| Aabb::around([q])).collect();
            let mut found = f64::INFINITY;
            Bvh::new(&boxes).nearest(&p, f64::INFINITY, |item, bound| {
                found = bound.min((points[item] - p).norm_squared());
                found
            });
            let all = points.iter().map(|q| (q - p).norm_squared()).fold(f64::INFINITY, f64::min);
            prop_assert_eq!(found, all);
        }

        #[test]
        fn box_distance_is_zero_inside_and_to_the_clamped_point_outside(a in point(), b in point(), p in point()) {
            let bounds = Aabb::around([&a, &b]);
            let clamped = p.coords.sup(&bounds.low.coords).inf(&bounds.high.coords);
            prop_assert!((bounds.distance_squared(&p) - (clamped - p.coords).norm_squared()).abs() < 1e-12);
        }
    }

    #[test]
    fn an_empty_tree_visits_nothing() {
        Bvh::new(&[]).nearest(&Point::origin(), f64::INFINITY, |_, _| panic!("there is nothing to visit"));
    }
}
