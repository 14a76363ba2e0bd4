//! Surfaces whose deviation under a given motion is known in closed form.

use super::fixtures::*;
use crate::geometry::Vector;
use std::f64::consts::{PI, TAU};

fn assert_depth(found: f64, wanted: f64, what: &str) {
    assert!((found - wanted).abs() <= 1e-8, "{what}: found {found}, wanted {wanted}");
}

#[test]
fn plane_by_flank_of_cylinder() {
    // Flank along X, axis along Y, plane z = 0; the tool stands 0.013 above the plane.
    let motion =
        Blocks::through(&[pose([-50.0, 0.0, 5.013], [0.0, 1.0, 0.0]), pose([50.0, 0.0, 5.013], [0.0, 1.0, 0.0])]);
    for x in [-50.0, -17.3, 0.0, 4.0, 49.0] {
        for y in [0.0, 11.0, 40.0] {
            assert_depth(depth(&cylinder(10.0), &motion, &ray([x, y, 0.0], [0.0, 0.0, 1.0])), 0.013, "flank");
        }
    }
    assert!(lowest(&cylinder(10.0), &motion, &ray([0.0, 40.1, 0.0], [0.0, 0.0, 1.0])).is_none());
    assert!(lowest(&cylinder(10.0), &motion, &ray([0.0, -1e-6, 0.0], [0.0, 0.0, 1.0])).is_none());
    // Beyond the end of the motion the round flank stands.
    let beyond = 5.013 - (25.0f64 - 1.0).sqrt();
    assert_depth(depth(&cylinder(10.0), &motion, &ray([51.0, 5.0, 0.0], [0.0, 0.0, 1.0])), beyond, "end");
}

#[test]
fn plane_by_ball_leaves_scallops() {
    let (radius, pitch) = (4.0, 1.0);
    let mut poses = Vec::new();
    for pass in 0..6 {
        let (y, side) = (f64::from(pass) * pitch, if pass % 2 == 0 { 20.0 } else { -20.0 });
        poses.push(pose([-side, y, 0.0], [0.0, 0.0, 1.0]));
        poses.push(pose([side, y, 0.0], [0.0, 0.0, 1.0]));
    }
    let motion = Blocks::through(&poses);
    for (y, wanted) in [(2.5, pitch / 2.0), (2.0, 0.0), (2.2, 0.2), (0.75, 0.25)] {
        let scallop = radius - f64::sqrt(radius * radius - wanted * wanted);
        for x in [-13.1, 0.0, 7.0] {
            assert_depth(depth(&ball(8.0), &motion, &ray([x, y, 0.0], [0.0, 0.0, 1.0])), scallop, "scallop");
        }
    }
}

#[test]
fn cylinder_of_the_part_by_one_full_turn() {
    // Part cylinder R 30 about Z, milled by the flank of a cylinder in one block that turns 360 degrees.
    let start = pose([35.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let motion = Blocks::feed(vec![Block::Turn(start, TAU)]);
    for k in 0..50 {
        let angle = f64::from(k) * 0.37;
        let normal = [angle.cos(), angle.sin(), 0.0];
        let sample = ray([30.0 * normal[0], 30.0 * normal[1], 12.0], normal);
        assert_depth(depth(&cylinder(10.0), &motion, &sample), 0.0, "turn");
    }
    // The flank of a cone whose axis leans outward by its half angle has a line parallel to Z.
    let half = 8.0f64.to_radians();
    let leaning = pose([36.0, 0.0, 0.0], [half.sin(), 0.0, half.cos()]);
    let coaxial = Blocks::feed(vec![Block::Turn(leaning, TAU)]);
    let inner = 36.0 - 3.0 * half.cos();
    for angle in [0.1, 2.0, 5.5] {
        let (sin, cos) = f64::sin_cos(angle);
        let sample = ray([inner * cos, inner * sin, 15.0], [cos, sin, 0.0]);
        assert_depth(depth(&cone(6.0, 8.0), &coaxial, &sample), 0.0, "cone on cylinder");
    }
}

#[test]
fn cone_of_the_part_by_the_flank_of_a_cone() {
    // Part: cone about Z of half angle b. Tool: cone of half angle a, axis in the plane through Z, so that flank and
    // part share a ruling; one turn makes the exact part.
    let (a, b) = (8.0f64.to_radians(), 15.0f64.to_radians());
    let ruling = Vector::new(b.sin(), 0.0, b.cos());
    let out = Vector::new(b.cos(), 0.0, -b.sin());
    // Axis direction: the ruling turned by a away from the part.
    let axis = ruling * a.cos() + out * a.sin();
    let start = Vector::new(20.0, 0.0, 0.0);
    // Flank begins at radius 3 at the tip plane: tip = start + 3 * (direction square to the axis).
    let square = out * a.cos() - ruling * a.sin();
    let tip = start + square * 3.0;
    let motion = Blocks::feed(vec![Block::Turn(pose(tip.into(), axis.into()), TAU)]);
    let tool = cone(6.0, 8.0);
    for (turn, along, lift) in [(0.3, 5.0, 0.0), (3.0, 20.0, 0.02), (6.0, 33.0, -0.02)] {
        let rotation = nalgebra::Rotation3::from_axis_angle(&Vector::z_axis(), turn);
        let point = rotation * (start + ruling * along - out * lift);
        let sample = ray(point.into(), (rotation * out).into());
        assert_depth(depth(&tool, &motion, &sample), lift, "cone on cone");
    }
}

#[test]
fn offset_of_a_hypar_by_the_flank_of_a_cylinder() {
    // The axis sweeps the hyperbolic paraboloid, so the flank of radius r sweeps its parallel surface at distance r: seen
    // from a point r + lift below along the normal, the tool stands `lift` above. Curvature radii are above 40 mm.
    let radius = 5.0;
    for k in [60.0, 150.0] {
        let whole = Hypar { k, from: -30.0, to: 30.0 };
        let corner = |i: u32| -30.0 + 60.0 / 7.0 * f64::from(i);
        let parts = (0..7).map(|i| Block::Hypar(Hypar { k, from: corner(i), to: corner(i + 1) }));
        for motion in [Blocks::feed(vec![Block::Hypar(whole)]), Blocks::feed(parts.collect())] {
            for (x, y) in [(-24.0, 4.0), (-9.3, 31.0), (0.0, 20.0), (4.2, 12.5), (17.0, 8.0), (25.0, 30.0)] {
                for (side, lift) in [(1.0, 0.0), (1.0, 0.031), (-1.0, 0.0), (-1.0, -0.02)] {
                    let (point, normal) = whole.at(x, y);
                    let normal = normal * side;
                    let sample = ray((point - normal * (radius + lift)).into(), normal.into());
                    assert_depth(depth(&cylinder(2.0 * radius), &motion, &sample), lift, "hypar");
                }
            }
        }
    }
}

#[test]
fn offset_of_a_helicoid_by_one_straight_block() {
    // The tip goes straight along X while the axis turns evenly about it: the axis sweeps the helicoid
    // (x, y cos(c x), y sin(c x)), the flank its parallel surface.
    let (length, twist, radius) = (40.0, 0.9, 5.0);
    let c = twist / length;
    let motion = Blocks::through(&[
        pose([0.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        pose([length, 0.0, 0.0], [0.0, f64::cos(twist), f64::sin(twist)]),
    ]);
    for (x, y) in [(6.0, 5.0), (13.7, 35.0), (20.0, 20.0), (33.0, 11.0)] {
        let (sin, cos) = f64::sin_cos(c * x);
        let point = Vector::new(x, y * cos, y * sin);
        // Across the ruling (0, cos, sin) the surface runs along (1, -c y sin, c y cos).
        let normal = Vector::new(0.0, cos, sin).cross(&Vector::new(-1.0, c * y * sin, -c * y * cos)).normalize();
        for (side, lift) in [(1.0, 0.0), (1.0, -0.044), (-1.0, 0.017)] {
            let normal = normal * side;
            let sample = ray((point - normal * (radius + lift)).into(), normal.into());
            assert_depth(depth(&cylinder(2.0 * radius), &motion, &sample), lift, "helicoid");
        }
    }
}

#[test]
fn cylinder_in_chords() {
    // Part cylinder R 25 milled by 36 chords of the tool's axis: mid-chord the tool is nearer by (R + r)(1 - cos(pi/36)).
    let (part, radius, chords) = (20.0, 5.0, 36);
    let corner = |k: usize| {
        let angle = TAU * k as f64 / chords as f64;
        pose([(part + radius) * angle.cos(), (part + radius) * angle.sin(), 0.0], [0.0, 0.0, 1.0])
    };
    let motion = Blocks::through(&(0..=chords).map(corner).collect::<Vec<_>>());
    let error = (part + radius) * (1.0 - (PI / chords as f64).cos());
    assert!((error - 0.095_133).abs() < 5e-7);
    for k in 0..chords {
        let angle = TAU * (k as f64 + 0.5) / chords as f64;
        let sample = ray([part * angle.cos(), part * angle.sin(), 3.0], [angle.cos(), angle.sin(), 0.0]);
        assert_depth(depth(&cylinder(10.0), &motion, &sample), -error, "chord");
        let corner = ray(
            [part * (TAU * k as f64 / 36.0).cos(), part * (TAU * k as f64 / 36.0).sin(), 3.0],
            [(TAU * k as f64 / 36.0).cos(), (TAU * k as f64 / 36.0).sin(), 0.0],
        );
        // At a corner both chords touch at pi/36 to either side.
        let wanted = corner_depth(part, radius, chords);
        assert_depth(depth(&cylinder(10.0), &motion, &corner), wanted, "corner");
    }
}

/// On the radial ray through a corner of the axis polygon the tool stands at the corner, or half way down the chord,
/// whichever is lower: the strip's edge at distance radius from the chord, cut by the ray, or the disc at the corner.
fn corner_depth(part: f64, radius: f64, chords: usize) -> f64 {
    let half = PI / chords as f64;
    // The ray makes the angle `half` with each chord's normal; the foot of the strip's edge lies inside the chord when
    // radius * tan(half) is below the chord's length, which holds here.
    let edge = (part + radius) - radius / half.cos();
    edge - part
}

#[test]
fn flat_end_mills_a_floor_and_its_gouge_is_exact() {
    let tip = |x: f64, z: f64| pose([x, 0.0, z], [0.0, 0.0, 1.0]);
    let motion = Blocks::through(&[tip(-30.0, 0.0), tip(0.0, 0.0), tip(0.0, -0.05), tip(0.0, 0.0), tip(30.0, 0.0)]);
    assert_depth(depth(&cylinder(10.0), &motion, &ray([3.0, 1.0, 0.0], [0.0, 0.0, 1.0])), -0.05, "gouge");
    assert_depth(depth(&cylinder(10.0), &motion, &ray([9.0, 1.0, 0.0], [0.0, 0.0, 1.0])), 0.0, "floor");
    assert_depth(depth(&ball(10.0), &motion, &ray([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])), -0.05, "ball gouge");
}

#[test]
fn deeper_than_the_window_is_the_window() {
    let motion =
        Blocks::through(&[pose([-30.0, 0.0, -3.0], [0.0, 0.0, 1.0]), pose([30.0, 0.0, -3.0], [0.0, 0.0, 1.0])]);
    for tool in [cylinder(10.0), ball(10.0), bull(10.0, 2.0)] {
        assert_depth(depth(&tool, &motion, &ray([1.0, 0.5, 0.0], [0.0, 0.0, 1.0])), -WINDOW.inward, "deep");
    }
}

#[test]
fn torus_corner_rolls_over_a_slope() {
    // A plane tilted by 30 degrees, touched by the corner of a bull nose: the support point of a torus is its centre
    // circle plus the corner radius along the normal.
    let (flat, corner) = (4.0, 2.0);
    let tilt = 30.0f64.to_radians();
    let normal = Vector::new(-tilt.sin(), 0.0, tilt.cos());
    let contact = Vector::new(1.0, 2.0, 1.0f64 * tilt.tan());
    // Contact on the tool: centre circle point (flat, 0, corner) minus corner * normal, on the uphill side (+x).
    let offset = Vector::new(flat, 0.0, corner) - normal * corner;
    let tip = contact - offset;
    let along = Vector::y() * 20.0;
    let motion =
        Blocks::through(&[pose((tip - along).into(), [0.0, 0.0, 1.0]), pose((tip + along).into(), [0.0, 0.0, 1.0])]);
    let origin = contact - normal * 0.007 + Vector::y() * 3.0;
    assert_depth(depth(&bull(12.0, corner), &motion, &ray(origin.into(), normal.into())), 0.007, "torus");
}
