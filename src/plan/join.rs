//! Fits neighbouring strips to each other. Where two envelopes cross, the lower one cuts: the angle of their crossing is
//! the kink. Where the end of a flank lies below the neighbour's envelope its rim cuts a groove, however shallow, and
//! the kink there is the rim's own. So the rims of all strips are kept above the strips that they pass, and between the
//! rims the difference of both deviations is made as flat as the limits of accuracy let it be.
//!
//! Strips are matched in turn, every second one at a time, to its neighbours as they stand.

use super::chart::Chart;
use super::fit::SphereFamily;
use super::fitted::FittedStrip;
use super::limits::Limits;
use super::polish::{Polish, Setting};
use super::rails::{RUN, Rails};
use super::refine::{CLOSE, judge_surely};
use super::touch::{Hint, Instant, Probe, Touch};
use super::trace::{Section, Trace, rims};
use super::{Method, Observer, PlanRequest};
use crate::optimize::minimax::{self, Minimax, Rows, Sides, minimize_largest};
use rayon::prelude::*;

/// Turns, each over every second strip.
const TURNS: usize = 3;
/// Linearizations of one strip in one round, and dense judgements, each followed by as many more.
const ROUNDS: usize = 6;
const JUDGEMENTS: usize = 2;
/// Share of what counts that a round must promise to gain.
const GAIN: f64 = 0.01;
/// Price of what strains a limit too much.
const FIRM: f64 = 20.0;
/// How many times as much as alone a strip may err where the number of strips is given: then its error counts as well.
const WORSE: f64 = 1.75;
/// Share of the strain that is borne which is kept between two judgements.
const HELD: f64 = 0.94;
/// Halvings of the way to a match on which the share is looked for that is borne where all of it strains a limit too much.
const HALVINGS: i32 = 4;
/// A straight flank that errs by e over the width d of its strip meets its neighbour at 16 e / d: the curvature of the
/// part along the flank makes both.
const NATURAL: f64 = 16.0;
/// How far beside the part, as a share of its parameter intervals, kinks and rims count.
const BESIDE: f64 = 0.015;
/// Share of the way from a border to the nearer rim over which the kink is taken, and of the band's width at most.
const NEAR: f64 = 0.5;
const NARROW: f64 = 0.15;
/// Price of the mean square of all kinks, against that of the largest.
const MEAN: f64 = 1.0;
/// Price of the mean square of what rims lie too low, in units of the limit.
const RIM: f64 = 300.0;
/// How many times what lies between path and program rims are kept above other strips: both may lie off their paths by as
/// much, and their words are rounded besides.
const LIFTED: f64 = 3.0;
/// Most of it, as a share of the flank, beyond once: over an overlap of some hundredths of the flank a larger lift would
/// make a kink of its own.
const LEANT: f64 = 1e-4;
/// Multiple of the strain that is borne from which on what stands out is not followed: the step was too bold.
const LITTLE: f64 = 1.5;
/// How much dearer steps become then.
const DEARER: f64 = 100.0;
/// How many strips away rims are looked for.
const AWAY: usize = 3;

/// How strips are joined.
#[derive(Clone, Copy, Debug)]
struct Joining {
    /// How much a kink counts against the error that it comes with on a straight flank.
    weight: f64,
    /// How far rims are kept above other strips, mm: what lies between the path and the program must not turn it over.
    lift: f64,
}

/// A point of the flank, at its instant, over another strip.
#[derive(Clone, Copy, Debug)]
struct Spot {
    /// Contact height, mm.
    height: f64,
    hint: Hint,
    /// The other strip.
    other: usize,
}

/// What counts at one instant.
#[derive(Clone, Debug)]
struct Meeting {
    t: f64,
    /// Two points between which the difference to the neighbour is to be flat.
    kinks: Vec<[Spot; 2]>,
    /// Where this strip's rim must lie above another strip (1), or another strip's rim above this one (-1).
    rims: Vec<(Spot, f64)>,
}

/// One strip's own problem with what its neighbours ask for.
struct Joint<'a> {
    polish: Polish<'a>,
    setting: Setting<'a>,
    rails: &'a Rails,
    traces: &'a [Trace],
    meetings: Vec<Meeting>,
    joining: Joining,
    /// Largest strain of the limits.
    bearable: f64,
    /// Number of rows for kinks, and for rims.
    counts: [usize; 2],
}

/// By how much this strip's envelope lies above another's at a spot, mm, and what that changes with.
struct Above {
    by: f64,
    touch: Touch,
    run: (usize, [f64; RUN]),
}

impl Joint<'_> {
    /// Sets the price of steps, `dear` times what is fair, for where `x` stands, and returns the first trust region, mm.
    fn ready(&mut self, x: &[f64], dear: f64) -> Option<f64> {
        let radius = self.polish.ready(x)?;
        let mut rows = Rows::default();
        self.polish.linearize(x, &mut rows)?;
        let alone = rows.largest_error()?.0;
        rows.clear();
        self.linearize(x, &mut rows)?;
        let all = rows.largest_error()?.0 + rows.soft(None);
        self.polish.dearer(dear * (all / alone.max(f64::MIN_POSITIVE)).max(1.0));
        Some(radius)
    }

    /// The strip as its kinks and rims ask for, from `start`, within its limits.
    fn refined(&mut self, start: Vec<f64>, strip: &FittedStrip) -> Option<FittedStrip> {
        let (setting, rails) = (self.setting, self.rails);
        let (mut x, mut reached, mut steps, mut dear) = (start.clone(), None, strip.steps, 1.0);
        for _ in 0..JUDGEMENTS {
            let settings = minimax::Settings {
                max_rounds: ROUNDS,
                gain_share: GAIN,
                radius: self.ready(&x, dear)?,
                penalty: FIRM,
                ..minimax::Settings::default()
            };
            steps += minimize_largest(self, &mut x, &settings)?.rounds;
            match judge_surely(setting, rails, &x, (&strip.resolution, self.bearable)) {
                Ok((matched, survey)) if setting.strain(&matched) <= LITTLE * self.bearable => {
                    if setting.strain(&matched) <= self.bearable {
                        return Some(FittedStrip { steps, ..matched });
                    }
                    reached = Some(x.clone());
                    // What stands out a little between the points followed is followed next.
                    if !self.polish.follow(&survey, self.bearable) {
                        break;
                    }
                }
                _ => {
                    x.clone_from(&start);
                    dear *= DEARER;
                }
            }
        }
        // Part of the way may be bearable where all of it is not.
        let reached = reached?;
        let (mut borne, mut share) = (None, 0.5);
        for halving in 0..HALVINGS {
            let x: Vec<f64> = start.iter().zip(&reached).map(|(a, b)| a + share * (b - a)).collect();
            let found = judge_surely(setting, rails, &x, (&strip.resolution, self.bearable)).ok();
            let step = 0.25 * 0.5_f64.powi(halving);
            match found.filter(|(matched, _)| setting.strain(matched) <= self.bearable) {
                Some((matched, _)) => {
                    borne = Some(FittedStrip { steps, ..matched });
                    share += step;
                }
                None => share -= step,
            }
        }
        borne
    }

    fn above(&self, probe: &Probe<'_>, (t, at): (f64, &Instant), spot: &Spot) -> Option<Above> {
        let touch = probe.touch_at(at, spot.height, &spot.hint).ok()?;
        let frame = &touch.foot.frame;
        let (g, h) = frame.place;
        let (deviation, slope) = self.traces.get(spot.other)?.section(h).deviation(g)?;
        let (tangent, rate) = frame.across_gauge()?;
        let out = frame.normal - tangent * (slope * rate);
        let run = self.polish.moving((t, at), &touch, &out);
        Some(Above { by: touch.foot.distance - deviation, touch, run })
    }

    /// The kink between two spots as the error that it comes with, mm.
    fn kink_rows(&self, rows: &mut Rows, probe: &Probe<'_>, (t, at): (f64, &Instant), pair: &[Spot; 2]) -> Option<()> {
        let [a, b] = [self.above(probe, (t, at), &pair[0])?, self.above(probe, (t, at), &pair[1])?];
        let (tangent, _) = a.touch.foot.frame.across_gauge()?;
        let apart = (b.touch.foot.frame.point - a.touch.foot.frame.point).dot(&tangent);
        let factor = at.length / (NATURAL * apart);
        let limit = self.setting.limits.mean() / self.joining.weight;
        let first = a.run.0;
        let value = factor * (b.by - a.by);
        if !value.is_finite() {
            return None;
        }
        let of = |by_a: f64, by_b: f64| {
            (0..RUN).map(move |i| (first + i, by_a * a.run.1[i] + by_b * b.run.1[i])).collect::<Vec<_>>()
        };
        let price = MEAN / (limit * limit * self.counts[0] as f64);
        rows.bound(value, Sides::even(limit), of(-factor, factor));
        rows.square(value, price, of(-factor, factor));
        // The envelopes are to cross here, not far away where they are less alike.
        rows.square(0.5 * (a.by + b.by), price, of(0.5, 0.5));
        Some(())
    }

    /// What a rim lies too low, if it does.
    fn rim_row(&self, rows: &mut Rows, probe: &Probe<'_>, at: (f64, &Instant), (spot, sign): &(Spot, f64)) {
        let Some(above) = self.above(probe, at, spot) else { return };
        let short = self.joining.lift - sign * above.by;
        if short > 0.0 {
            let limit = self.setting.limits.mean();
            let price = RIM * self.joining.weight / (limit * limit * self.counts[1] as f64);
            let gradient = above.run.1.into_iter().enumerate().map(|(i, g)| (above.run.0 + i, -sign * g));
            rows.square(short, price, gradient);
        }
    }
}

impl Minimax for Joint<'_> {
    fn unknowns(&self) -> usize {
        self.rails.unknowns()
    }

    fn linearize(&mut self, x: &[f64], rows: &mut Rows) -> Option<()> {
        self.polish.linearize(x, rows)?;
        let motion = self.rails.motion(x)?;
        let probe = self.setting.probe(&motion);
        for meeting in &self.meetings {
            let at = probe.instant(meeting.t)?;
            for pair in &meeting.kinks {
                if self.kink_rows(rows, &probe, (meeting.t, &at), pair).is_none() {
                    rows.bound(0.0, Sides::FREE, []);
                }
            }
            for rim in &meeting.rims {
                self.rim_row(rows, &probe, (meeting.t, &at), rim);
            }
        }
        Some(())
    }
}

/// The strips and their envelopes as they stand.
struct Standing<'a> {
    setting: Setting<'a>,
    strips: &'a [FittedStrip],
    traces: &'a [Trace],
    /// Largest strain of each strip's limits; 0 where it is to stay as it is.
    borne: &'a [f64],
}

impl Standing<'_> {
    /// The line g = const at which strip `i` and the next one meet: the middle of what both cover.
    fn border(&self, i: usize) -> Option<f64> {
        Some(0.5 * (self.strips.get(i)?.borders.high + self.strips.get(i + 1)?.borders.low))
    }

    fn section(&self, i: usize, h: f64) -> Option<Section> {
        Some(self.traces.get(i)?.section(h))
    }

    /// The strip that covers g.
    fn at(&self, g: f64) -> Option<usize> {
        let strips = self.strips;
        (0..strips.len()).find(|i| g < self.border(*i).unwrap_or(f64::INFINITY)).filter(|_| (0.0..=1.0).contains(&g))
    }

    /// What strip `i` meets along its way.
    fn meetings(&self, i: usize) -> Option<Vec<Meeting>> {
        let strip = self.strips.get(i)?;
        let probe = self.setting.probe(&strip.motion);
        let (start, end) = strip.motion.domain();
        let instants = 2 * strip.resolution.instants;
        let mut found = Vec::with_capacity(instants);
        let mut near = [None; 2];
        for j in 0..instants {
            let t = start + (end - start) * j as f64 / (instants - 1) as f64;
            let Some(at) = probe.instant(t) else { continue };
            let mut meeting = Meeting { t, kinks: Vec::new(), rims: Vec::new() };
            for upper in [false, true] {
                let known = near[usize::from(upper)];
                let g = if upper { strip.borders.high } else { strip.borders.low };
                let place = known.unwrap_or((g, strip.borders.first));
                let share = if upper { 1.0 } else { 0.0 };
                let Some(hint) = probe.hint(&at, share, place) else { continue };
                near[usize::from(upper)] = Some(hint.place);
                self.meet(&mut meeting, &probe, &at, (i, upper), hint);
            }
            found.push(meeting);
        }
        Some(found)
    }

    /// What strip `i` meets at one of its ends, at an instant.
    fn meet(&self, meeting: &mut Meeting, probe: &Probe<'_>, at: &Instant, (i, upper): (usize, bool), hint: Hint) {
        let over = |spot: &Spot| probe.touch_at(at, spot.height, &spot.hint).ok().map(|touch| touch.foot.frame);
        let (low, high) = rims(probe.tool);
        let rim = Spot { height: if upper { high } else { low }, hint, other: i };
        if let Some(frame) = over(&rim).filter(|frame| frame.within(BESIDE))
            && let Some(other) = self.at(frame.place.0).filter(|other| *other != i)
        {
            meeting.rims.push((Spot { other, ..rim }, 1.0));
        }
        let h = hint.place.1;
        let Some(own) = self.section(i, h) else { return };
        let neighbours = (1..=AWAY).filter_map(|k| if upper { Some(i + k) } else { i.checked_sub(k) });
        for other in neighbours {
            let Some(section) = self.section(other, h) else { continue };
            let Some((first, last)) = section.rims() else { continue };
            let g = if upper { first } else { last };
            let spot = own.height(g).map(|height| Spot { height, hint, other });
            if let Some(spot) = spot.filter(|s| (low..=high).contains(&s.height))
                && over(&spot).is_some_and(|frame| frame.within(BESIDE))
            {
                meeting.rims.push((spot, -1.0));
            }
        }
        if let Some(pair) = self.pair(&own, (i, upper), hint)
            && pair.iter().all(|spot| over(spot).is_some_and(|frame| frame.within(BESIDE)))
        {
            meeting.kinks.push(pair);
        }
    }

    /// Two points on either side of a border.
    fn pair(&self, own: &Section, (i, upper): (usize, bool), hint: Hint) -> Option<[Spot; 2]> {
        let below = if upper { i } else { i.checked_sub(1)? };
        let (other, border) = (if upper { i + 1 } else { below }, self.border(below)?);
        let section = self.section(other, hint.place.1)?;
        let (own_rims, rims) = (own.rims()?, section.rims()?);
        let (first, last) = if upper { (rims.0, own_rims.1) } else { (own_rims.0, rims.1) };
        let band = self.strips.get(i).map(|strip| strip.borders.high - strip.borders.low)?;
        let near = (NEAR * (border - first).min(last - border)).min(NARROW * band);
        let spot = |g: f64| Some(Spot { height: own.height(g)?, hint, other });
        (near > 0.0).then_some([spot(border - near)?, spot(border + near)?])
    }

    /// Strip `i` matched to its neighbours; none where that leads nowhere, or beyond the limits.
    fn matched(&self, i: usize, joining: Joining) -> Option<FittedStrip> {
        let strip = self.strips.get(i)?;
        let setting = Setting { borders: &strip.borders, ..self.setting };
        let bearable = self.borne.get(i).copied().filter(|borne| *borne > 0.0)?;
        let meetings = self.meetings(i)?;
        let count = |of: fn(&Meeting) -> usize| meetings.iter().map(of).sum::<usize>().max(1);
        let counts = [count(|m| m.kinks.len()), count(|m| m.rims.len())];
        let (rails, start) = Rails::of(&strip.motion);
        let followed = (2 * strip.resolution.instants - 1, strip.resolution.heights);
        let mut polish = Polish::new(setting, &rails, &start, followed)?;
        polish.bear(HELD * bearable);
        let traces = self.traces;
        let mut joint = Joint { polish, setting, rails: &rails, traces, meetings, joining, bearable, counts };
        joint.refined(start, strip)
    }
}

/// Strips of one plan fitted to each other, where that is wanted.
pub(super) fn joined(
    request: &PlanRequest<'_>,
    (chart, family, limits): (&Chart<'_>, &SphereFamily, &Limits),
    mut strips: Vec<FittedStrip>,
) -> Vec<FittedStrip> {
    let strategy = request.strategy;
    let wanted = strategy.method == Method::Regulus && strategy.smoothness > 0.0 && strips.len() > 1;
    if let Some(borders) = strips.first().map(|strip| strip.borders).filter(|_| wanted) {
        // Between the points looked at errors are a little larger.
        let close = &Limits { overcut: CLOSE * limits.overcut, undercut: CLOSE * limits.undercut };
        let setting = Setting { chart, tool: request.tool, family, borders: &borders, limits: close };
        let worse = if strategy.strips.is_some() { WORSE } else { f64::INFINITY };
        let between = request.linearization;
        let lift = (LIFTED * between).min(LEANT * (family.highest() - family.lowest())).max(between);
        let joining = Joining { weight: strategy.smoothness, lift };
        // What strains its limits too much has nothing to give for a smoother seam.
        let borne = |strip: &FittedStrip| {
            let alone = Setting { limits, ..setting }.strain(strip);
            if alone > 1.0 { 0.0 } else { (worse * alone).min(1.0).max(setting.strain(strip)) }
        };
        let borne: Vec<f64> = strips.iter().map(borne).collect();
        join(setting, (&mut strips, &borne), joining, request.observer);
    }
    strips
}

/// Lets neighbouring strips meet more smoothly, as far as the limits of accuracy bear it.
fn join(
    setting: Setting<'_>,
    (strips, borne): (&mut [FittedStrip], &[f64]),
    joining: Joining,
    observer: &dyn Observer,
) {
    let trace =
        |strip: &FittedStrip| Trace::new(&setting.probe(&strip.motion), (strip.borders.low, strip.borders.first));
    let mut traces: Vec<Trace> = strips.par_iter().map(trace).collect();
    for turn in 0..TURNS {
        if observer.stopped() {
            break;
        }
        let standing = Standing { setting, strips, traces: &traces, borne };
        let matched: Vec<Option<FittedStrip>> = (0..strips.len())
            .into_par_iter()
            .map(|i| (i % 2 == turn % 2).then(|| standing.matched(i, joining)).flatten())
            .collect();
        for ((strip, traced), matched) in strips.iter_mut().zip(&mut traces).zip(matched) {
            if let Some(matched) = matched {
                *traced = trace(&matched);
                *strip = matched;
            }
        }
    }
}
