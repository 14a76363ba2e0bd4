//! How far two motions of a tool are apart: each a chain of straight pieces of tip and a second axis point, matched
//! along their way, so that it does not matter where either is cut into blocks. Uses `geometry`.
//!
//! A place on a motion is the pair of tip and flank point, six numbers; its way is measured with the Euclidean length of
//! that pair, so that turning about the tip is a way, too. A matching is a monotone list of pairs of places that holds
//! every vertex of both chains. Between neighbouring pairs both motions are straight, so the distance of tips, and of
//! flank points, is convex and largest at a pair: the distances reported are exact for the chains under the matching,
//! and upper bounds of the least possible over all matchings (the Fréchet distance; Alt and Godau 1995).

use crate::geometry::Point;

/// Cost of a step along the one chain that is longer than along the other, against distance squared: enough to keep a
/// motion that goes back on itself from being cut short, too little to move a foot by more than rounding.
const SLIP: f64 = 0.01;
/// How far ahead of the step's own length a foot is looked for: factor of the length, mm, factor of the distance so
/// far and the most that this adds, mm.
const AHEAD: (f64, f64, f64, f64) = (1.5, 0.05, 2.0, 2.0);

/// A vertex of a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TracePoint {
    /// The tip, part frame, mm.
    pub tip: Point,
    /// The point of the axis at the height that is compared, part frame, mm.
    pub flank: Point,
    /// When the tool is here, s.
    pub seconds: f64,
    /// Line of the program whose block leads here.
    pub line: usize,
    /// Whether a rapid leads here.
    pub rapid: bool,
}

impl TracePoint {
    fn mix(&self, other: &Self, share: f64) -> Self {
        Self {
            tip: self.tip + (other.tip - self.tip) * share,
            flank: self.flank + (other.flank - self.flank) * share,
            seconds: self.seconds + (other.seconds - self.seconds) * share,
            line: other.line,
            rapid: other.rapid,
        }
    }

    fn distance_squared(&self, other: &Self) -> f64 {
        (self.tip - other.tip).norm_squared() + (self.flank - other.flank).norm_squared()
    }
}

/// A largest difference and the lines of both programs where it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Largest {
    /// The difference, mm or s.
    pub value: f64,
    /// Line of the first and of the second program.
    pub lines: [usize; 2],
}

impl Largest {
    /// Keeps the larger; the earlier of equal ones.
    pub fn take(&mut self, other: Self) {
        if other.value > self.value || self.lines == [0, 0] {
            *self = other;
        }
    }
}

/// How far two motions are apart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Apart {
    /// Of the tips, mm.
    pub tip: Largest,
    /// Of the flank points, mm.
    pub flank: Largest,
    /// Of the times since each motion began, or last came from a rapid to a feed, s.
    pub time: Largest,
}

impl Apart {
    /// Keeps the larger of each.
    pub fn take(&mut self, other: &Self) {
        self.tip.take(other.tip);
        self.flank.take(other.flank);
        self.time.take(other.time);
    }

    /// Largest distance of tips and flank points, mm.
    pub fn distance(&self) -> f64 {
        self.tip.value.max(self.flank.value)
    }
}

/// Two motions compared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Comparison {
    /// Where both are at a feed.
    pub feed: Apart,
    /// Where either is a rapid; `None` where that is nowhere.
    pub rapid: Option<Apart>,
}

impl Comparison {
    /// Keeps the larger of each.
    pub fn take(&mut self, other: &Self) {
        self.feed.take(&other.feed);
        if let Some(rapid) = &other.rapid {
            self.rapid.get_or_insert_default().take(rapid);
        }
    }

    fn distances(&self) -> (f64, f64) {
        (self.feed.distance(), self.rapid.map_or(0.0, |rapid| rapid.distance()))
    }
}

/// Compares two motions from their first to their last vertex; `None` where one has no vertex.
pub fn compare(first: &[TracePoint], second: &[TracePoint]) -> Option<Comparison> {
    let (a, b) = (Chain::new(first)?, Chain::new(second)?);
    let even = measure(&a, &b, &evenly(&a, &b));
    let followed = measure(&a, &b, &follow(&a, &b));
    Some(if followed.distances() <= even.distances() { followed } else { even })
}

/// A place on a chain: the edge that ends at a vertex, and how far along the whole chain.
#[derive(Clone, Copy, Debug)]
struct Place {
    edge: usize,
    way: f64,
}

struct Chain<'a> {
    points: &'a [TracePoint],
    /// Way from the start to each vertex, mm.
    ways: Vec<f64>,
}

impl<'a> Chain<'a> {
    fn new(points: &'a [TracePoint]) -> Option<Self> {
        let first = points.first()?;
        let (mut way, mut last) = (0.0, first);
        let ways = points.iter().map(|point| {
            way += point.distance_squared(last).sqrt();
            last = point;
            way
        });
        Some(Self { ways: ways.collect(), points })
    }

    fn length(&self) -> f64 {
        self.ways.last().copied().unwrap_or_default()
    }

    fn vertex(&self, index: usize) -> Place {
        Place { edge: index, way: self.ways[index] }
    }

    fn last(&self) -> Place {
        self.vertex(self.points.len() - 1)
    }

    /// The place that far along.
    fn at_way(&self, way: f64) -> Place {
        let edge = self.ways.partition_point(|known| *known < way).min(self.points.len() - 1);
        Place { edge, way: way.clamp(0.0, self.length()) }
    }

    fn point(&self, place: Place) -> TracePoint {
        let end = &self.points[place.edge];
        let Some(start) = place.edge.checked_sub(1).map(|index| &self.points[index]) else { return *end };
        let (low, high) = (self.ways[place.edge - 1], self.ways[place.edge]);
        if high <= low { *end } else { start.mix(end, ((place.way - low) / (high - low)).clamp(0.0, 1.0)) }
    }

    /// The place nearest to `target` between two ways, starting to look at edge `from`; stepping to another way than
    /// `wanted` costs `slip` times the square of the difference.
    fn nearest(&self, target: &TracePoint, from: Place, until: f64, wanted: f64, slip: f64) -> Place {
        let cost = |place: Place| {
            let off = place.way - wanted;
            self.point(place).distance_squared(target) + slip * off * off
        };
        let mut best = from;
        let mut least = cost(from);
        for edge in from.edge.max(1)..self.points.len() {
            let (start, end) = (self.ways[edge - 1], self.ways[edge]);
            if start > until {
                break;
            }
            let (low, high) = (start.max(from.way), end.min(until));
            if high < low {
                continue;
            }
            let place = Place { edge, way: self.foot(target, edge, wanted, slip).clamp(low, high) };
            let found = cost(place);
            if found < least {
                (best, least) = (place, found);
            }
        }
        best
    }

    /// The way along an edge, made endless, at which the cost is least: that of a parabola.
    fn foot(&self, target: &TracePoint, edge: usize, wanted: f64, slip: f64) -> f64 {
        let (start, end) = (&self.points[edge - 1], &self.points[edge]);
        let (low, length) = (self.ways[edge - 1], self.ways[edge] - self.ways[edge - 1]);
        if length <= 0.0 {
            return low;
        }
        let along = (end.tip - start.tip).dot(&(target.tip - start.tip))
            + (end.flank - start.flank).dot(&(target.flank - start.flank));
        (low + along / length + slip * wanted) / (1.0 + slip)
    }
}

/// Pairs of places at equal shares of both ways.
fn evenly(a: &Chain, b: &Chain) -> Vec<[Place; 2]> {
    let scale = if a.length() > 0.0 { b.length() / a.length() } else { 0.0 };
    let mut pairs: Vec<[Place; 2]> = Vec::with_capacity(a.points.len());
    for index in 0..a.points.len() {
        let place = a.vertex(index);
        let mut other = b.at_way(place.way * scale);
        if let Some([_, before]) = pairs.last() {
            other.way = other.way.max(before.way);
        }
        pairs.push([place, other]);
    }
    close(a, b, &mut pairs);
    pairs
}

/// Pairs every vertex of `a` with its foot on `b`, step by step ahead; then moves each foot to the nearest place between
/// its neighbours.
fn follow(a: &Chain, b: &Chain) -> Vec<[Place; 2]> {
    let mut pairs: Vec<[Place; 2]> = Vec::with_capacity(a.points.len());
    let mut at = b.vertex(0);
    let mut last = 0.0;
    let mut distance: f64 = 0.0;
    for index in 0..a.points.len() {
        let place = a.vertex(index);
        let step = place.way - last;
        last = place.way;
        let ahead = AHEAD.0 * step + AHEAD.1 + (AHEAD.2 * distance).min(AHEAD.3);
        at = b.nearest(&a.points[index], at, at.way + ahead, at.way + step, SLIP);
        distance = b.point(at).distance_squared(&a.points[index]).sqrt();
        pairs.push([place, at]);
    }
    for index in 1..pairs.len().saturating_sub(1) {
        let [before, here, after] = [index - 1, index, index + 1].map(|k| pairs[k][1]);
        // The half ways keep the feet of neighbours apart.
        let low = Place { way: (before.way + here.way) / 2.0, ..b.at_way((before.way + here.way) / 2.0) };
        let high = (here.way + after.way) / 2.0;
        pairs[index][1] = b.nearest(&a.points[index], low, high, here.way, 0.0);
    }
    close(a, b, &mut pairs);
    pairs
}

/// Both motions begin and end together.
fn close(a: &Chain, b: &Chain, pairs: &mut Vec<[Place; 2]>) {
    if let Some(first) = pairs.first_mut() {
        first[1] = b.vertex(0);
    }
    pairs.push([a.last(), b.last()]);
}

/// Adds the vertices of `b` to the pairs and takes the largest differences.
fn measure(a: &Chain, b: &Chain, pairs: &[[Place; 2]]) -> Comparison {
    let mut found = Comparison::default();
    let (start_a, start_b) = (a.points[0].seconds, b.points[0].seconds);
    // How far apart the clocks are since both were at a feed last.
    let (mut base, mut stopped) = (0.0, false);
    let mut see = |at: Place, bt: Place, rapid: bool| {
        let (p, q) = (a.point(at), b.point(bt));
        let clocks = (p.seconds - start_a) - (q.seconds - start_b);
        if std::mem::replace(&mut stopped, rapid) && !rapid {
            base = clocks;
        }
        let lines = [p.line, q.line];
        let apart = Apart {
            tip: Largest { value: (p.tip - q.tip).norm(), lines },
            flank: Largest { value: (p.flank - q.flank).norm(), lines },
            time: Largest { value: (clocks - base).abs(), lines },
        };
        if rapid {
            found.rapid.get_or_insert_default().take(&apart);
        } else {
            found.feed.take(&apart);
        }
    };
    let rapid = |at: Place, bt: Place| a.points[at.edge].rapid || b.points[bt.edge].rapid;
    let mut next = 0;
    for pair in pairs.windows(2) {
        let [[a0, b0], [a1, b1]] = *pair else { continue };
        let (mut from, mut reached) = ((a0, b0), a0);
        while next < b.points.len() && b.ways[next] <= b1.way {
            let place = b.vertex(next);
            if place.way > b0.way && place.way < b1.way {
                reached = a.nearest(&b.points[next], reached, a1.way, 0.0, 0.0);
                // The first place of a piece on an edge belongs to the edge.
                let kind = rapid(a1, place);
                see(from.0, from.1, kind);
                see(reached, place, kind);
                from = (reached, place);
            }
            next += 1;
        }
        let kind = rapid(a1, b1);
        see(from.0, from.1, kind);
        see(a1, b1, kind);
    }
    if let [[at, bt]] = *pairs {
        see(at, bt, rapid(at, bt));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector;
    use proptest::prelude::*;

    const HEIGHT: f64 = 30.0;

    /// A motion through places with the axis upright, at 10 mm/s; each leg cut into `pieces`.
    fn trace(places: &[[f64; 3]], pieces: usize) -> Vec<TracePoint> {
        let mut points: Vec<TracePoint> = Vec::new();
        let mut seconds = 0.0;
        for (line, pair) in places.windows(2).enumerate() {
            let (from, to) = (Point::from(pair[0]), Point::from(pair[1]));
            for k in usize::from(!points.is_empty())..=pieces {
                let tip = from + (to - from) * (k as f64 / pieces as f64);
                seconds += points.last().map_or(0.0, |last| (tip - last.tip).norm() / 10.0);
                points.push(TracePoint {
                    tip,
                    flank: tip + Vector::z() * HEIGHT,
                    seconds,
                    line: line + 1,
                    rapid: false,
                });
            }
        }
        points
    }

    #[test]
    fn the_same_motion_in_other_blocks_is_the_same() {
        let places = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 7.0, 0.0], [10.0, 7.0, 5.0], [10.0, 7.0, 0.0]];
        for (a, b) in [(1, 7), (7, 1), (3, 5)] {
            let apart = compare(&trace(&places, a), &trace(&places, b)).unwrap().feed;
            assert!(apart.distance() < 1e-12 && apart.time.value < 1e-12, "{apart:?}");
        }
    }

    /// Straight against an arc of radius R: the rise of the arc over its chord, at its middle.
    #[test]
    fn an_arc_and_its_chord_are_apart_by_the_rise() {
        let radius = 50.0;
        let at = |angle: f64| [radius * angle.sin(), radius * angle.cos() - radius, 0.0];
        let arc: Vec<_> = (0..=400).map(|k| at(0.2 * f64::from(k - 200) / 200.0)).collect();
        let chord = [arc[0], arc[400]];
        let apart = compare(&trace(&arc, 1), &trace(&chord, 3)).unwrap().feed;
        let rise = radius * (1.0 - 0.2_f64.cos());
        assert!((apart.tip.value - rise).abs() < 1e-9 && (apart.flank.value - rise).abs() < 1e-9, "{apart:?}");
        assert_eq!(apart.tip.lines[0], 200);
    }

    /// A plunge that goes back up on the same line, once a little less deep.
    #[test]
    fn a_motion_that_goes_back_on_itself_is_followed_to_its_end() {
        let deep = |z: f64| [[0.0, 0.0, 0.0], [0.0, 0.0, z], [0.0, 0.0, 0.0], [4.0, 0.0, 0.0]];
        for (a, b) in [(-5.0, -4.9), (-4.9, -5.0), (-0.02, -0.01)] {
            let apart = compare(&trace(&deep(a), 9), &trace(&deep(b), 4)).unwrap().feed;
            let off = (a - b).abs();
            assert!((apart.tip.value - off).abs() < 1e-9, "{a} {b}: {apart:?}");
            assert!((apart.time.value - 2.0 * off / 10.0).abs() < 0.1 * off, "{apart:?}");
        }
    }

    /// A detour that is a rapid in one of them counts apart.
    #[test]
    fn rapids_count_apart() {
        let places = |out: f64| [[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [9.0, out, 0.0], [9.0, 0.0, 0.0], [20.0, 0.0, 0.0]];
        let mut a = trace(&places(5.0), 3);
        a.iter_mut().for_each(|point| point.rapid = [2, 3].contains(&point.line));
        let found = compare(&a, &trace(&places(4.0), 5)).unwrap();
        assert!(found.feed.distance() < 1e-9, "{found:?}");
        assert!((found.rapid.unwrap().tip.value - 1.0).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn a_turn_about_the_tip_is_seen_at_the_flank_alone() {
        let tilted = |angle: f64, line: usize| TracePoint {
            tip: Point::origin(),
            flank: Point::new(HEIGHT * angle.sin(), 0.0, HEIGHT * angle.cos()),
            seconds: 0.0,
            line,
            rapid: false,
        };
        let a: Vec<_> = (0..=100).map(|k| tilted(f64::from(k) * 1e-3, 1)).collect();
        let b: Vec<_> = (0..=100).map(|k| tilted(f64::from(k) * 1.01e-3, 2)).collect();
        let apart = compare(&a, &b).unwrap().feed;
        assert_eq!(apart.tip.value, 0.0);
        assert!((apart.flank.value - 2.0 * HEIGHT * (0.001_f64 / 2.0).sin()).abs() < 1e-9, "{apart:?}");
        assert_eq!(compare(&a, &[]), None);
    }

    proptest! {
        /// Moving every vertex by at most r moves the motion by at most r, and at least by what its ends moved.
        #[test]
        fn distances_are_those_of_what_was_moved(
            steps in prop::collection::vec(prop::array::uniform3(-3.0..3.0), 2..20),
            shift in prop::array::uniform3(-1e-3..1e-3), pieces in 1_usize..6,
        ) {
            let mut places = vec![[0.0; 3]];
            for step in steps {
                let last = places[places.len() - 1];
                places.push([last[0] + step[0], last[1] + step[1], last[2] + step[2]]);
            }
            let moved: Vec<_> = places.iter().map(|p| [p[0] + shift[0], p[1] + shift[1], p[2] + shift[2]]).collect();
            let apart = compare(&trace(&places, pieces), &trace(&moved, 2)).unwrap().feed;
            let by = Vector::from(shift).norm();
            prop_assert!(apart.tip.value >= by * (1.0 - 1e-9) && apart.tip.value <= by * 1.5 + 1e-12, "{} {by}", apart.tip.value);
            prop_assert!((apart.tip.value - apart.flank.value).abs() < 1e-12);
        }
    }
}
