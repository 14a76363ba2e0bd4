//! The search against brute force and against itself.

use super::fixtures::*;
use crate::geometry::{Direction, Point, Vector};
use crate::motion::Pose;
use crate::tool::Element;
use crate::tool::meridian::{ArcSide, at};
use crate::verify::body::Body;
use crate::verify::motion_tree::MotionTree;
use crate::verify::ray::LocalRay;
use crate::verify::swept::{Query, SweptTool};
use crate::verify::{BlockMotion, Instant, NormalRay};
use proptest::prelude::*;

fn direction() -> impl Strategy<Value = Direction> {
    (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64)
        .prop_filter_map("too short", |(x, y, z)| Direction::try_new(Vector::new(x, y, z), 0.1))
}

/// Inside by the definition of a surface of revolution: nothing shared with the code under test.
fn inside(tool: &crate::tool::Tool, pose: &Pose, point: &Point) -> bool {
    let offset = point - pose.tip;
    let height = offset.dot(&pose.axis);
    let rho = (offset - pose.axis.into_inner() * height).norm();
    (0.0..=tool.flute_length()).contains(&height) && tool.contact_at(height).is_some_and(|c| rho <= c.point.radius)
}

/// A waist: a hollow arc of radius 20 between two short cylinders, narrowest with radius 5 at height 20.
fn waisted() -> Body {
    let hollow = Element::Arc {
        centre: at(20.0, 25.0),
        radius: 20.0,
        from: -0.75f64.acos(),
        to: -(-0.75f64).acos(),
        side: ArcSide::Concave,
    };
    let (low, high) = (hollow.start(), hollow.end());
    let below = Element::Line { from: at(0.0, low.radius), to: low };
    let above = Element::Line { from: high, to: at(40.0, high.radius) };
    Body::of([Element::Line { from: at(0.0, 0.0), to: at(0.0, low.radius) }, below, hollow, above].iter())
}

/// Inside of the waist, in its own words.
fn inside_waist(pose: &Pose, point: &Point) -> bool {
    let offset = point - pose.tip;
    let height = offset.dot(&pose.axis);
    let rho = (offset - pose.axis.into_inner() * height).norm();
    let rim = 25.0 - f64::sqrt(400.0 - 225.0);
    (0.0..=40.0).contains(&height) && rho <= rim && (height - 20.0).hypot(rho - 25.0) >= 20.0
}

#[test]
fn farther_on_is_so_far_along_the_way_and_ends_with_the_cut() {
    let up = [0.0, 0.0, 1.0];
    let at = |x: f64| pose([x, 0.0, 0.0], up);
    let mut motion = Blocks::through(&[at(0.0), at(2.0), at(5.0), at(9.0)]);
    motion.rapid[2] = true;
    let tree = MotionTree::new(&motion, 20.0, 1e-5, |block| block < 2);
    let body = Body::of(cylinder(10.0).flutes().iter());
    let sweep = SweptTool::new(&motion, &tree, &body, WINDOW, 1e-6);
    let from = Instant { block: 0, share: 0.5 };
    let place = |way: f64| {
        let [when] = sweep.farther_on(from, [way]);
        let when = when?;
        Some(motion.pose(when.block, when.share).tip.x)
    };
    for way in [-1.0, -0.4, 0.0, 0.7, 1.5, 3.9] {
        assert!(place(way).is_some_and(|x| (x - 1.0 - way).abs() < 1e-12), "{way}");
    }
    assert_eq!(place(-1.1), None);
    assert_eq!(place(4.1), None);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn hollow_tools_are_followed_too(
        axis in direction(),
        turn in direction(),
        normal in direction(),
        aim in (0.0..40.0f64, 0.0..1.0f64, -0.8..0.8f64),
    ) {
        let body = waisted();
        let end = Direction::new_normalize(axis.into_inner() + turn.into_inner() * 0.2);
        let poses = [
            Pose { tip: Point::origin(), axis },
            Pose { tip: Point::new(6.0, 1.0, -2.0), axis: end },
            Pose { tip: Point::new(12.0, -3.0, 1.0), axis },
        ];
        let motion = Blocks::through(&poses);
        let pose = motion.pose(0, aim.1);
        let out = pose.axis.cross(&normal).normalize();
        let radius = body.pieces.iter().flat_map(|p| &p.spans).find(|s| (s.low..=s.high).contains(&aim.0)).unwrap().radius_at(aim.0);
        let tilted = Direction::new_normalize(normal.into_inner() * 0.4 - out);
        let ray = NormalRay { origin: pose.at_height(aim.0) + out * radius - tilted.into_inner() * aim.2, normal: tilted };

        let mut brute = f64::INFINITY;
        for (block, k) in (0..2).flat_map(|b| (0..=60).map(move |k| (b, k))) {
            let pose = motion.pose(block, f64::from(k) / 60.0);
            let entry = body.entry(&LocalRay::new(&ray, &pose), -1.0, 1.0);
            let limit = entry.map_or(1.0, |e| e.lambda);
            for j in 0..100 {
                let lambda = -1.0 + 2.0 * f64::from(j) / 100.0;
                let within = inside_waist(&pose, &(ray.origin + tilted.into_inner() * lambda));
                prop_assert!(lambda >= limit - 1e-9 || !within, "inside at {lambda}, entry {entry:?}");
            }
            if let Some(e) = entry {
                let just_in = (0..200).any(|j| {
                    inside_waist(&pose, &(ray.origin + tilted.into_inner() * (e.lambda + 1e-10 * 1.1f64.powi(j))))
                });
                prop_assert!(just_in, "nothing behind {e:?}");
                brute = brute.min(e.lambda);
            }
        }
        let tree = MotionTree::new(&motion, 40.0, 1e-5, |_| true);
        let sweep = SweptTool::new(&motion, &tree, &body, WINDOW, 1e-6);
        let found = sweep.lowest(&ray, &Query { hint: None, end: usize::MAX, limit: f64::INFINITY });
        let depth = found.map_or(f64::INFINITY, |t| t.depth);
        prop_assert!(depth <= brute + 1.1e-6, "found {depth}, brute force {brute}");
    }

    #[test]
    fn entry_is_where_the_line_first_is_inside(
        which in 0usize..8,
        axis in direction(),
        normal in direction(),
        offset in (-12.0..12.0f64, -12.0..12.0f64, -5.0..45.0f64),
    ) {
        let tool = &menagerie()[which];
        let pose = Pose { tip: Point::new(3.0, -2.0, 1.0), axis };
        let ray = NormalRay { origin: Point::new(offset.0, offset.1, offset.2), normal };
        let body = Body::of(tool.flutes().iter());
        let at = |lambda: f64| ray.origin + ray.normal.into_inner() * lambda;
        let entry = body.entry(&LocalRay::new(&ray, &pose), -5.0, 5.0);
        let limit = entry.map_or(5.0, |e| e.lambda);
        for k in 0..2000 {
            let lambda = -5.0 + 10.0 * f64::from(k) / 2000.0;
            prop_assert!(lambda >= limit - 1e-9 || !inside(tool, &pose, &at(lambda)), "inside at {lambda}, entry {limit}");
        }
        if let Some(entry) = entry {
            prop_assert!(entry.lambda == -5.0 || !inside(tool, &pose, &at(entry.lambda - 1e-7)));
            let just_in = (1..200).any(|k| inside(tool, &pose, &at(entry.lambda + 1e-9 * 1.1f64.powi(k))));
            prop_assert!(just_in, "nothing behind the entry {entry:?}");
        }
    }

    #[test]
    fn search_agrees_with_brute_force_in_time(
        which in 0usize..8,
        axes in prop::collection::vec(direction(), 2),
        wobble in prop::collection::vec((-0.3..0.3f64, -0.3..0.3f64, -0.3..0.3f64), 12),
        normal in direction(),
        aim in (0.0..11.0f64, 0.0..40.0f64, -0.8..0.8f64),
        spread in 0.01..5.0f64,
    ) {
        let tool = &menagerie()[which];
        let poses: Vec<Pose> = wobble.iter().enumerate().map(|(k, w)| {
            let share = k as f64 / 11.0;
            let mixed = axes[0].into_inner() * (1.5 - share) + axes[1].into_inner() * 0.3 * share + Vector::new(w.0, w.1, w.2) * 0.1;
            Pose { tip: Point::new(2.0 * k as f64 + w.0, w.1, w.2), axis: Direction::new_normalize(mixed) }
        }).collect();
        let motion = Blocks::through(&poses);
        // Aim the ray at the flank of some pose, so that most cases touch.
        let pose = motion.pose((aim.0 as usize).min(10), aim.0.fract());
        let contact = tool.contact_at(aim.1).unwrap();
        let out = pose.axis.cross(&normal).normalize();
        let surface = pose.at_height(contact.point.height) + out * contact.point.radius;
        let outward = pose.axis.into_inner() * contact.normal_axial + out * contact.normal_radial;
        let tilted = Direction::new_normalize(-outward + normal.into_inner() * 0.4);
        let ray = NormalRay { origin: surface - tilted.into_inner() * aim.2, normal: tilted };

        let body = Body::of(tool.flutes().iter());
        let mut brute = f64::INFINITY;
        for block in 0..motion.blocks() {
            for k in 0..=400 {
                let pose = motion.pose(block, f64::from(k) / 400.0);
                if let Some(e) = body.entry(&LocalRay::new(&ray, &pose), -1.0, 1.0) {
                    brute = brute.min(e.lambda);
                }
            }
        }
        let found = lowest(tool, &motion, &ray);
        let depth = found.map_or(f64::INFINITY, |t| t.depth);
        prop_assert!(depth <= brute + 1.1e-6, "found {depth}, brute force {brute}");
        if let Some(touch) = found {
            // What was found is real.
            let pose = motion.pose(touch.when.block, touch.when.share);
            let entry = body.entry(&LocalRay::new(&ray, &pose), -1.0, 1.0).unwrap();
            prop_assert!((entry.lambda - touch.depth).abs() < 1e-12);
        }
        // A hint never changes the result by more than the resolution.
        let hinted = lowest_from(tool, &motion, &ray, Some(Instant { block: 3, share: 0.3 })).map_or(f64::INFINITY, |t| t.depth);
        prop_assert!(hinted == depth || (hinted - depth).abs() <= 1.1e-6, "{hinted} {depth}");
        // Nor does company.
        let tree = MotionTree::new(&motion, tool.flute_length(), 1e-5, |_| true);
        let sweep = SweptTool::new(&motion, &tree, &body, WINDOW, 1e-6);
        let cluster: Vec<(NormalRay, Query)> = wobble.iter().map(|w| {
            let offset = Vector::new(w.0, w.1, w.2) * spread;
            let normal = Direction::new_normalize(tilted.into_inner() + offset * 0.1);
            let query = Query { hint: None, end: usize::MAX, limit: f64::INFINITY };
            (NormalRay { origin: ray.origin + offset, normal }, query)
        }).collect();
        for ((ray, query), found) in cluster.iter().zip(sweep.lowest_of(&cluster)) {
            let alone = sweep.lowest(ray, query);
            let depths = [found, alone].map(|touch| touch.map_or(f64::INFINITY, |t| t.depth));
            // Where the tool only begins to graze the ray it enters by less than a tenth of the resolution.
            let deeper = if depths[0] < depths[1] { found } else { alone };
            let grazes = deeper.is_some_and(|touch| touch.tool_normal.dot(&ray.normal) > -0.01);
            let same = depths[0] == depths[1] || (depths[0] - depths[1]).abs() <= 1.1e-6;
            prop_assert!(same || grazes, "{found:?} {alone:?}");
        }
    }

    #[test]
    fn lines_that_pass_a_rim_closely_are_settled(
        rise in 0.0..0.3f64,
        apart in (-8.0..-3.0f64, prop::bool::ANY),
        around in 0.0..6.2f64,
        way in (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64),
        tilt in (-0.1..0.1f64, -0.1..0.1f64),
    ) {
        let tool = cone(6.0, 2.0);
        let body = Body::of(tool.flutes().iter());
        let middle = pose([1.0, 2.0, 3.0], [0.3, -0.2, 1.0]);
        let (step, turn) = (Vector::new(way.0, way.1, way.2) * 0.3, Vector::new(tilt.0, tilt.1, 0.0) * 0.1);
        let end = |sign: f64| Pose {
            tip: middle.tip + step * sign,
            axis: Direction::new_normalize(middle.axis.into_inner() + turn * sign),
        };
        let motion = Blocks::through(&[end(-1.0), middle, end(1.0)]);
        let axis = middle.axis.into_inner();
        let side = axis.cross(&Vector::x()).normalize();
        let out = side * around.cos() + axis.cross(&side) * around.sin();
        let rim = middle.at_height(40.0) + out * body.pieces[0].spans[0].high_radius;
        let distance = 10f64.powf(apart.0) * if apart.1 { 1.0 } else { -1.0 };
        let normal = Direction::new_normalize(axis * rise.sin() - out * rise.cos());
        let ray = NormalRay { origin: rim + (axis * rise.cos() + out * rise.sin()) * distance, normal };

        let entries = (0..2).flat_map(|block| (0..=20_000).map(move |k| (block, f64::from(k) / 20_000.0)));
        let brute = entries
            .filter_map(|(block, share)| body.entry(&LocalRay::new(&ray, &motion.pose(block, share)), -1.0, 1.0))
            .fold(f64::INFINITY, |least, e| least.min(e.lambda));
        let found = lowest(&tool, &motion, &ray).map_or(f64::INFINITY, |t| t.depth);
        // What enters by less than a tenth of the resolution, square to the tool, may be passed over.
        let deeper = NormalRay { origin: ray.origin + (axis * rise.cos() + out * rise.sin()) * 1.1e-7, ..ray };
        let certain = (0..2)
            .flat_map(|block| (0..=20_000).map(move |k| (block, f64::from(k) / 20_000.0)))
            .filter_map(|(block, share)| body.entry(&LocalRay::new(&deeper, &motion.pose(block, share)), -1.0, 1.0))
            .fold(f64::INFINITY, |least, e| least.min(e.lambda));
        prop_assert!(found <= brute + 1.1e-6 || found <= certain + 1.1e-6, "found {found}, brute force {brute}, {certain}");
    }
}
