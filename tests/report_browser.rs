//! The report as a browser shows it, headless Chromium. Left out, loudly, where there is none; fails there when the
//! environment variable `REGULUS_REQUIRE_CONTROLLER` is set.

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::path::Path;
    use std::process::Command;

    #[test]
    fn page_comes_up_whole_with_its_view_and_without_complaint() {
        if Command::new("chromium").arg("--version").output().is_err() {
            assert!(std::env::var_os("REGULUS_REQUIRE_CONTROLLER").is_none(), "chromium is not installed");
            // Straight to the terminal: the test harness would swallow it.
            writeln!(std::io::stderr(), "LEFT OUT: the report in a browser, for want of chromium").unwrap();
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let job = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/exact-cone/job.toml");
        let run =
            Command::new(env!("CARGO_BIN_EXE_regulus")).arg("run").arg(job).arg("--out").arg(folder.path()).output();
        assert!(run.unwrap().status.success());
        let page = format!("file://{}", folder.path().join("report.html").display());
        let profile = format!("--user-data-dir={}", folder.path().join("profile").display());
        let browser = Command::new("chromium")
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader"])
            .args(["--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run", "--disable-component-update"])
            .args(["--disable-background-networking", "--disable-sync", "--virtual-time-budget=3000"])
            .args(["--enable-logging=stderr", &profile, "--dump-dom", &page])
            .output()
            .unwrap();
        let shown = String::from_utf8_lossy(&browser.stdout);
        let body = shown.lines().find(|line| line.contains("<body")).unwrap_or_default();
        assert!(body.contains("data-state=\"ready\"") && body.contains("data-view=\"shown\""), "{body}");
        let complaints = String::from_utf8_lossy(&browser.stderr);
        let console = complaints.lines().filter(|line| line.contains("CONSOLE") && !line.contains("ReadPixels"));
        assert_eq!(console.collect::<Vec<_>>(), Vec::<&str>::new());
    }
}
