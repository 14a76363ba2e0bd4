//! The wanted machining directions: one tangent vector, or a field of them given at points of the part (Rajain 2023,
//! section 3). Uses `diagnostic`, `geometry` and the rest of this method.

use super::sheet::{Frame, inside};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{Point, Vector};
use crate::part::DesignSurface;
use nalgebra::Matrix3;

/// A field of machining directions, part frame: a unit vector at each of several points.
#[derive(Clone, Debug, PartialEq)]
pub struct DirectionField {
    entries: Vec<(Point, Vector)>,
}

const LAYOUT: &str = "write a header line, then one line a point: x,y,z,dx,dy,dz, all in the frame of the part's file";
/// Points may lie this far off the part, as a share of its size.
const OFF_PART: f64 = 0.01;
/// No place of the part may be farther from all points than this share of its size.
const FARTHEST: f64 = 0.25;
/// Neighbours that count for a place.
const NEIGHBOURS: usize = 6;
/// How much one direction must stand out among the neighbours: 0 is none at all, 1 is all alike.
const LEAST_AGREEMENT: f64 = 0.15;

impl DirectionField {
    /// Reads a field's text: a header line, then x, y, z, dx, dy, dz by position. `to_part` brings both into the part
    /// frame. Refuses vectors of no length, points off the surface, vectors along its normal, and a surface that the
    /// points leave bare.
    pub fn read(
        text: &str,
        file: &str,
        surface: &DesignSurface,
        to_part: &crate::geometry::RigidMotion,
        unit: f64,
    ) -> Result<Self> {
        let size = surface.bounds().diagonal();
        let mut entries: Vec<(Point, Vector)> = Vec::new();
        let mut offset = 0;
        for (index, line) in text.split_inclusive('\n').enumerate() {
            let at = offset;
            offset += line.len();
            if index == 0 || line.trim().is_empty() {
                continue;
            }
            let refuse = |message: String, help: &str| {
                Err(Diagnostic::error(message).in_file(file).at_offset(text, at).help(help))
            };
            let [x, y, z, dx, dy, dz] = match numbers(line) {
                Ok(values) => values,
                Err(message) => return refuse(message, LAYOUT),
            };
            let point = to_part * (Point::new(x, y, z) * unit);
            let vector = to_part.rotation * Vector::new(dx, dy, dz);
            let Some(direction) = vector.try_normalize(1e-9) else {
                let help = "give a direction at every point; leave out points that have none";
                return refuse("the direction has no length".to_owned(), help);
            };
            let foot = surface.foot(&point);
            let off = (foot.point - point).norm();
            if off > OFF_PART * size {
                let message = format!("the point lies {off:.3} mm off the part: the field does not match it");
                return refuse(message, "give points on the part, in the frame of the part's file");
            }
            let tangential = direction - foot.normal.0.into_inner() * foot.normal.0.dot(&direction);
            let Some(tangent) = tangential.try_normalize(0.05) else {
                let message = "the direction stands on the surface: along it the field is zero".to_owned();
                return refuse(message, "give directions along the surface");
            };
            entries.push((point, tangent));
        }
        let field = Self { entries };
        field.check_cover(surface, size, file)?;
        Ok(field)
    }

    fn check_cover(&self, surface: &DesignSurface, size: f64, file: &str) -> Result<()> {
        let far = surface
            .sample(size / 12.0)
            .samples
            .iter()
            .map(|s| s.point)
            .find(|p| self.entries.iter().all(|(q, _)| (p - q).norm() > FARTHEST * size));
        let Some(at) = far else { return Ok(()) };
        let message = format!(
            "no point of the field lies within {:.1} mm of ({:.3}, {:.3}, {:.3}) on the part: the field does not match it",
            FARTHEST * size,
            at.x,
            at.y,
            at.z
        );
        Err(Diagnostic::error(message).in_file(file).help("give directions all over the part"))
    }

    /// The line of directions at `p`, of no sense: the first principal axis of the neighbours' directions, nearer ones
    /// counting more. `None` where they contradict each other, so that the field is zero in between.
    fn at(&self, p: &Point) -> Option<Vector> {
        let mut nearest: Vec<(f64, usize)> =
            self.entries.iter().enumerate().map(|(i, (q, _))| ((p - q).norm_squared(), i)).collect();
        let count = NEIGHBOURS.min(nearest.len());
        nearest.select_nth_unstable_by(count.checked_sub(1)?, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        nearest.truncate(count);
        nearest.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let reach = nearest.iter().map(|(d, _)| *d).fold(0.0, f64::max).max(1e-12);
        let mut tensor = Matrix3::zeros();
        for (distance, index) in &nearest {
            let (_, t) = self.entries[*index];
            // Falls smoothly to nothing at the farthest neighbour.
            tensor += t * t.transpose() * ((1.0 - distance / (1.05 * reach)).powi(2) / (distance + 1e-3 * reach));
        }
        let eigen = tensor.symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let (first, second) = (eigen.eigenvalues[order[0]], eigen.eigenvalues[order[1]]);
        (first - second > LEAST_AGREEMENT * (first + second)).then(|| eigen.eigenvectors.column(order[0]).into_owned())
    }
}

/// The six numbers of a line.
fn numbers(line: &str) -> std::result::Result<[f64; 6], String> {
    let mut values = [0.0; 6];
    let fields: Vec<&str> = line.split(',').map(str::trim).collect();
    if fields.len() != values.len() {
        return Err(format!("{} values where 6 are needed", fields.len()));
    }
    for (value, field) in values.iter_mut().zip(fields) {
        match field.parse::<f64>() {
            Ok(number) if number.is_finite() => *value = number,
            _ => return Err(format!("\"{field}\" is not a finite number")),
        }
    }
    Ok(values)
}

/// Where the machining directions come from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Source<'a> {
    /// One vector, projected into every tangent plane.
    Vector(Vector),
    /// Vectors at points.
    Field(&'a DirectionField),
}

/// The wanted directions with the side on which the spindle is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wish<'a> {
    /// Machining directions; their sense does not count.
    pub(super) source: Source<'a>,
    /// Roughly from the tip toward the spindle.
    pub(super) toward: Vector,
}

impl Wish<'_> {
    /// The unit tangents across the machining direction, toward the spindle, at the places of a grid given in rows of
    /// `columns`. `None` past the edges where there is no direction; on the surface that is refused.
    pub(super) fn across(&self, frames: &[Option<Frame>], columns: usize) -> Result<Vec<Option<Vector>>> {
        let mut across: Vec<Option<Vector>> = Vec::with_capacity(frames.len());
        for frame in frames {
            let wanted = match frame {
                Some(frame) => self.across_at(frame)?,
                None => None,
            };
            across.push(wanted);
        }
        self.orient(frames, &mut across, columns)?;
        Ok(across)
    }

    /// The unit tangent across the direction, of no sense yet.
    fn across_at(&self, frame: &Frame) -> Result<Option<Vector>> {
        let along = match self.source {
            Source::Vector(direction) => frame.along(&direction),
            Source::Field(field) => field.at(&frame.point).and_then(|direction| frame.along(&direction)),
        };
        let p = frame.point;
        match along {
            Some(along) => Ok(Some(frame.normal.cross(&along))),
            None if !inside(frame.place) => Ok(None),
            None => Err(match self.source {
                Source::Vector(_) => Diagnostic::error(format!(
                    "the direction stands on the surface near ({:.3}, {:.3}, {:.3}): there it is none",
                    p.x, p.y, p.z
                ))
                .help("give a [strategy] direction along the surface, or directions at points as [strategy.rajain] field"),
                Source::Field(_) => Diagnostic::error(format!(
                    "the direction field is zero near ({:.3}, {:.3}, {:.3}): its directions there contradict each other",
                    p.x, p.y, p.z
                ))
                .help("give directions that run side by side over the whole surface"),
            }),
        }
    }

    /// Gives all one sense: each that of its neighbour, the first that nearest the spindle's side.
    fn orient(&self, frames: &[Option<Frame>], across: &mut [Option<Vector>], columns: usize) -> Result<()> {
        let on_surface = |i: usize| frames[i].as_ref().is_some_and(|f| inside(f.place));
        // From the place where the wish for a side says most.
        let clear = |i: &usize| across[*i].map_or(0.0, |a| a.dot(&self.toward).abs());
        let seed =
            (0..frames.len()).filter(|i| on_surface(*i)).max_by(|a, b| clear(a).total_cmp(&clear(b)).then(b.cmp(a)));
        let Some(seed) = seed else { return Ok(()) };
        let mut settled = vec![false; frames.len()];
        let turn = |a: &mut Option<Vector>, by: &Vector| {
            if let Some(a) = a.as_mut().filter(|a| a.dot(by) < 0.0) {
                *a = -*a;
            }
        };
        turn(&mut across[seed], &self.toward);
        settled[seed] = true;
        let mut queue = std::collections::VecDeque::from([seed]);
        while let Some(i) = queue.pop_front() {
            let Some(own) = across[i] else { continue };
            let (row, column) = (i / columns, i % columns);
            let mut next = [None; 4];
            if column > 0 {
                next[0] = Some(i - 1);
            }
            if column + 1 < columns {
                next[1] = Some(i + 1);
            }
            if row > 0 {
                next[2] = Some(i - columns);
            }
            if i + columns < frames.len() {
                next[3] = Some(i + columns);
            }
            for j in next.into_iter().flatten() {
                if !settled[j] {
                    turn(&mut across[j], &own);
                    settled[j] = true;
                    queue.push_back(j);
                } else if let Some((frame, other)) = frames[j].as_ref().zip(across[j])
                    && on_surface(i)
                    && on_surface(j)
                    && other.dot(&own) < 0.0
                {
                    let p = frame.point;
                    return Err(Diagnostic::error(format!(
                        "the directions turn round a point near ({:.3}, {:.3}, {:.3}): there the field is zero",
                        p.x, p.y, p.z
                    ))
                    .help("give directions that run side by side over the whole surface"));
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::graph;
    use super::super::guide::Guide;
    use super::super::sheet::Sheet;
    use super::*;
    use crate::geometry::RigidMotion;

    fn plate() -> DesignSurface {
        DesignSurface::Spline(graph(20.0, 10.0, |_, _| 0.0))
    }

    /// The field of `direction` at a grid of points of the plate.
    fn field_of(direction: impl Fn(f64, f64) -> (f64, f64)) -> String {
        let mut text = "x,y,z,dx,dy,dz\n".to_owned();
        for i in 0..=10 {
            for j in 0..=5 {
                let (x, y) = (2.0 * f64::from(i) - 10.0, 2.0 * f64::from(j) - 5.0);
                let (dx, dy) = direction(x, y);
                text += &format!("{x},{y},0,{dx},{dy},0\n");
            }
        }
        text
    }

    fn read(text: &str) -> Result<DirectionField> {
        DirectionField::read(text, "field.csv", &plate(), &RigidMotion::identity(), 1.0)
    }

    #[test]
    fn a_field_is_followed_whatever_the_sense_of_its_vectors() {
        // Circles about (0, -30), every second vector turned round.
        let flip = |x: f64, y: f64| if ((x + y) / 2.0).round() as i64 % 2 == 0 { -1.0 } else { 1.0 };
        let field = read(&field_of(|x, y| ((y + 30.0) * flip(x, y), -x * flip(x, y)))).unwrap();
        let plate = graph(20.0, 10.0, |_, _| 0.0);
        let wish = Wish { source: Source::Field(&field), toward: Vector::y() };
        let guide = Guide::new(Sheet::new(&plate), &wish, 1.0).unwrap();
        for place in [(0.1, 0.2), (0.9, 0.8), (0.4, 0.6)] {
            let curve = guide.onto(place, guide.level(place), false).unwrap();
            let p = curve.frame.point;
            let circle = Vector::new(p.y + 30.0, -p.x, 0.0).normalize();
            assert!(curve.tangent.dot(&circle) > 0.9995, "{p} {} {circle}", curve.tangent);
        }
    }

    #[test]
    fn a_whirl_is_refused_with_its_place() {
        let field = read(&field_of(|x, y| (y - 0.1, 0.2 - x))).unwrap();
        let plate = graph(20.0, 10.0, |_, _| 0.0);
        let wish = Wish { source: Source::Field(&field), toward: Vector::y() };
        let said = Guide::new(Sheet::new(&plate), &wish, 1.0).unwrap_err();
        assert!(said.message.contains(" near ("), "{said}");
    }

    #[test]
    fn lines_that_do_not_match_the_part_are_refused_with_their_place() {
        let good = field_of(|_, _| (1.0, 0.0));
        assert!(read(&good).is_ok());
        for (from, to, message) in [
            ("-8,-5,0,1,0,0", "-8,-5,0,0,0,0", "no length"),
            ("-8,-5,0,1,0,0", "-8,-5,3,1,0,0", "3.000 mm off the part"),
            ("-8,-5,0,1,0,0", "-8,-5,0,0,0,1", "stands on the surface"),
            ("-8,-5,0,1,0,0", "-8,-5,0,1,0", "5 values where 6"),
            ("-8,-5,0,1,0,0", "-8,-5,0,1,0,inf", "not a finite number"),
        ] {
            assert!(good.contains(from));
            let said = read(&good.replacen(from, to, 1)).unwrap_err();
            assert!(said.message.contains(message), "{said}");
            let place = said.place.unwrap();
            assert_eq!((place.file.as_str(), place.line), ("field.csv", Some(8)), "{message}");
        }
        let bare: String =
            good.lines().filter(|l| !l.starts_with(['4', '6', '8', '1'])).map(|l| format!("{l}\n")).collect();
        assert!(read(&bare).unwrap_err().message.contains("does not match"));
        assert!(read("").is_err());
    }
}
