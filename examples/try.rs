use regulus::{geometry::*, motion::FeedReference, part::*, plan::*, tool::*};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let surface =
        read(&std::fs::read(&a[1]).unwrap(), &a[1], &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let part = Part { name: "x".into(), surface, check: vec![] };
    let g = |k: &str, d: f64| {
        a.iter().find_map(|x| x.strip_prefix(&format!("{k}=")).map(|v| v.parse().unwrap())).unwrap_or(d)
    };
    let tip = g("tip", 6.0);
    let ang = g("ang", 4.0);
    let fl = g("flute", 40.0);
    let shape = CutterShape::Cone {
        tip_diameter: tip,
        half_angle: Degrees(ang),
        corner_radius: g("corner", 0.0),
        flute_length: fl,
    };
    let sh = g("shank", 0.0);
    let tool = Tool::new(
        1,
        &shape,
        &Fixture { shank_diameter: (sh > 0.0).then_some(sh), gauge_length: g("gauge", fl + 50.0), holder: vec![] },
    )
    .unwrap();
    let n = g("strips", 0.0) as usize;
    let mut st = Strategy::new(if n == 1 { StrategyKind::SingleSweep } else { StrategyKind::MultiStrip });
    if n > 1 {
        st.strips = Some(n)
    }
    if a.iter().any(|x| x == "rulings") {
        st.method = Method::Rulings
    }
    if a.iter().any(|x| x == "tiphigh") {
        st.tip = Some(TipSide::High)
    }
    if a.iter().any(|x| x == "tiplow") {
        st.tip = Some(TipSide::Low)
    }
    if a.iter().any(|x| x == "alongu") {
        let m = s_dir(&part, true);
        st.direction = Some(m)
    }
    if a.iter().any(|x| x == "alongv") {
        let m = s_dir(&part, false);
        st.direction = Some(m)
    }
    let e = g("from", -1.0);
    if e >= 0.0 {
        st.engage_from = Some(e)
    }
    st.fairness = g("fair", 1.0);
    let t = std::time::Instant::now();
    let r = plan(&PlanRequest {
        name: "x",
        part: &part,
        tool: &tool,
        strategy: &st,
        overcut_tolerance: g("o", 0.005),
        undercut_tolerance: g("u", 0.03),
        cut_feed: 600.0,
        feed_reference: FeedReference::Mid,
        spindle_rpm: 8000.0,
        linearization: 0.001,
    });
    match r {
        Ok(p) => {
            for s in &p.strips {
                println!("{:?} len {:.1} eng {:.2} steps {}", s.deviation, s.length, s.engagement, s.steps)
            }
            println!("{} passes", p.path.passes.len())
        }
        Err(e) => println!("{e}"),
    }
    println!("{:?}", t.elapsed());
}
fn s_dir(p: &Part, u: bool) -> Vector {
    if let DesignSurface::Spline(o) = &p.surface {
        let [(a, b), (c, d)] = o.surface().domain();
        let j = o.surface().jet((a + b) / 2.0, (c + d) / 2.0);
        if u { j.su.normalize() } else { j.sv.normalize() }
    } else {
        panic!()
    }
}
