//! Bodies of the machine and fixtures, as the report page shows them.

use crate::geometry::{RigidMotion, Vector};
use crate::machine::{Body, Form, Link};
use crate::report::{BodyView, LinkTrack, Mesh};
use crate::simulate::{Segment, ToolMotion};

/// The bodies, and where each link that moves against the part is at the end of some blocks.
pub(super) fn body_views<'a>(
    motion: &ToolMotion,
    fixtures: &[Body],
    segments: impl Iterator<Item = &'a Segment>,
) -> (Vec<BodyView>, Vec<LinkTrack>) {
    let setup = motion.setup();
    let mut links: Vec<Link> = Vec::new();
    let bodies = setup.machine().bodies.iter().filter_map(|body| {
        let mut mesh = mesh(body)?;
        let link = (body.link != Link::Table).then(|| {
            links.iter().position(|link| *link == body.link).unwrap_or_else(|| {
                links.push(body.link);
                links.len() - 1
            })
        });
        if link.is_none() {
            // It stands with the part, whose frame begins at the work offset.
            let zero = Vector::from(setup.work_offset());
            mesh.points.iter_mut().for_each(|p| *p -= zero);
        }
        Some(BodyView { name: body.name.clone(), fixture: false, mesh, link })
    });
    let bodies: Vec<BodyView> = bodies.collect();
    let fixtures = fixtures
        .iter()
        .filter_map(|body| Some(BodyView { name: body.name.clone(), fixture: true, mesh: mesh(body)?, link: None }));
    let shown: Vec<&Segment> = segments.collect();
    let track = |link: &Link| -> Vec<RigidMotion> {
        shown.iter().map(|segment| setup.seen_from_part(*link, &segment.to)).collect()
    };
    (bodies.into_iter().chain(fixtures).collect(), links.iter().map(track).collect())
}

/// `None` for a body whose file has not been read.
fn mesh(body: &Body) -> Option<Mesh> {
    match &body.form {
        Form::Box { low, high } => Some(Mesh::cuboid(low, high)),
        Form::Cylinder { base, axis, radius, length } => Some(Mesh::cylinder(base, axis, *radius, *length)),
        Form::Mesh(mesh) => Some(Mesh::of(mesh)),
        Form::File(_) => None,
    }
}
