//! Tools and motions for tests, built without machine or program.

use crate::geometry::{Degrees, Direction, Point, Vector};
use crate::motion::Pose;
use crate::tool::meridian::at;
use crate::tool::{CutterShape, Fixture, ProfilePoint, Tool};
use crate::verify::BlockMotion;
use crate::verify::Runs;
use crate::verify::body::Body;
use crate::verify::motion_tree::MotionTree;
use crate::verify::swept::Query;
use crate::verify::swept::SweptTool;
use crate::verify::{Instant, NormalRay, Touch, Window};

pub(super) const WINDOW: Window = Window { inward: 1.0, outward: 1.0 };

/// One test block.
#[derive(Clone, Copy)]
pub(super) enum Block {
    /// Tip straight, axis on the great circle.
    Straight(Pose, Pose),
    /// Turned about the part's Z axis by an angle in radians.
    Turn(Pose, f64),
    /// Along the rulings of a hyperbolic paraboloid.
    Hypar(Hypar),
}

/// The hyperbolic paraboloid z = x y / k, its rulings x = const followed from `from` to `to`, the tip at y = 0.
#[derive(Clone, Copy)]
pub(super) struct Hypar {
    pub(super) k: f64,
    pub(super) from: f64,
    pub(super) to: f64,
}

impl Hypar {
    /// Point at (x, y), and the normal that points to positive z.
    pub(super) fn at(&self, x: f64, y: f64) -> (Vector, Vector) {
        (Vector::new(x, y, x * y / self.k), Vector::new(-y / self.k, -x / self.k, 1.0).normalize())
    }

    fn pose(&self, share: f64) -> Pose {
        let x = self.from + (self.to - self.from) * share;
        pose([x, 0.0, 0.0], [0.0, self.k, x])
    }
}

#[derive(Clone, Default)]
pub(super) struct Blocks {
    pub(super) blocks: Vec<Block>,
    pub(super) rapid: Vec<bool>,
}

impl Blocks {
    pub(super) fn feed(blocks: Vec<Block>) -> Self {
        let rapid = vec![false; blocks.len()];
        Self { blocks, rapid }
    }

    /// Straight blocks through poses.
    pub(super) fn through(poses: &[Pose]) -> Self {
        Self::feed(poses.windows(2).map(|w| Block::Straight(w[0], w[1])).collect())
    }
}

impl BlockMotion for Blocks {
    fn blocks(&self) -> usize {
        self.blocks.len()
    }

    fn pose(&self, block: usize, share: f64) -> Pose {
        match &self.blocks[block] {
            Block::Straight(a, b) => a.interpolate(b, share),
            Block::Turn(pose, angle) => {
                let turn = nalgebra::Rotation3::from_axis_angle(&Vector::z_axis(), angle * share);
                Pose { tip: turn * pose.tip, axis: turn * pose.axis }
            }
            Block::Hypar(hypar) => hypar.pose(share),
        }
    }

    fn chord_bound(&self, block: usize, from: f64, to: f64, height: f64) -> f64 {
        let (reach, angle) = match &self.blocks[block] {
            Block::Straight(a, b) => (height.abs(), a.axis_angle(b)),
            Block::Turn(pose, angle) => (pose.at_height(height).coords.xy().norm(), *angle),
            // The axis (cos t, sin t), tan t = x / k, has a second derivative of at most sqrt(1 + 0.65²) / k² < 1.2 / k².
            Block::Hypar(hypar) => (1.2 * height.abs(), (hypar.to - hypar.from) / hypar.k),
        };
        reach * (angle * (to - from)).powi(2) / 8.0
    }

    fn is_rapid(&self, block: usize) -> bool {
        self.rapid[block]
    }
}

/// Runs between rapids.
pub(super) fn runs(motion: &Blocks) -> Runs {
    Runs::of(&motion.rapid)
}

pub(in crate::verify) fn pose(tip: [f64; 3], axis: [f64; 3]) -> Pose {
    Pose { tip: Point::from(tip), axis: Direction::new_normalize(Vector::from(axis)) }
}

pub(super) fn ray(origin: [f64; 3], normal: [f64; 3]) -> NormalRay {
    NormalRay { origin: Point::from(origin), normal: Direction::new_normalize(Vector::from(normal)) }
}

pub(super) fn tool(shape: &CutterShape) -> Tool {
    Tool::new(1, shape, &Fixture { shank_diameter: None, gauge_length: 200.0, holder: vec![] }).unwrap()
}

pub(super) fn cylinder(diameter: f64) -> Tool {
    tool(&CutterShape::Cylinder { diameter, corner_radius: 0.0, flute_length: 40.0 })
}

pub(super) fn ball(diameter: f64) -> Tool {
    tool(&CutterShape::Cylinder { diameter, corner_radius: diameter / 2.0, flute_length: 40.0 })
}

pub(super) fn bull(diameter: f64, corner_radius: f64) -> Tool {
    tool(&CutterShape::Cylinder { diameter, corner_radius, flute_length: 40.0 })
}

pub(super) fn cone(tip_diameter: f64, half_angle: f64) -> Tool {
    tool(&CutterShape::Cone { tip_diameter, half_angle: Degrees(half_angle), corner_radius: 0.0, flute_length: 40.0 })
}

/// Barrel, bull, cone with corner, tapered ball, and a waisted polyline: every kind of element and joint.
pub(super) fn menagerie() -> Vec<Tool> {
    let mut tools = vec![cylinder(10.0), ball(8.0), bull(12.0, 2.0), cone(6.0, 8.0), cone(14.0, -6.0)];
    tools.push(tool(&CutterShape::TaperedBall { ball_diameter: 6.0, half_angle: Degrees(5.0), flute_length: 40.0 }));
    tools.push(tool(&CutterShape::Barrel {
        diameter: 12.0,
        barrel_radius: 90.0,
        half_angle: Degrees(4.0),
        corner_radius: 1.0,
        flute_length: 40.0,
    }));
    tools.push(tool(&CutterShape::Meridian {
        points: [at(0.0, 3.0), at(10.0, 6.0), at(20.0, 4.0), at(30.0, 5.0), at(40.0, 9.0)]
            .map(|point| ProfilePoint { point, bulge: 0.0 })
            .to_vec(),
    }));
    tools
}

/// The lowest touch, by the whole machinery.
pub(super) fn lowest(tool: &Tool, motion: &Blocks, ray: &NormalRay) -> Option<Touch> {
    lowest_from(tool, motion, ray, None)
}

pub(super) fn lowest_from(tool: &Tool, motion: &Blocks, ray: &NormalRay, hint: Option<Instant>) -> Option<Touch> {
    let body = Body::of(tool.flutes().iter());
    let tree = MotionTree::new(motion, tool.flute_length(), 1e-5, |_| true);
    SweptTool::new(motion, &tree, &body, WINDOW, 1e-6)
        .lowest(ray, &Query { hint, end: usize::MAX, limit: f64::INFINITY })
}

pub(super) fn depth(tool: &Tool, motion: &Blocks, ray: &NormalRay) -> f64 {
    lowest(tool, motion, ray).map_or(f64::NAN, |t| t.depth)
}
