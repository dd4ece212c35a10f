//! A real browser without a window, for pages that programs write.

use std::env;
use std::ffi::OsStr;
use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::firmware::runs;
use crate::process::finish;

/// Set this environment variable to `1` where a missing browser must be a failure, not a skipped test.
pub const REQUIRED: &str = "TPG_REQUIRE_BROWSER";
/// The browser's name, and that of its package in Debian.
const CHROMIUM: &str = "chromium";

/// Chromium. It draws on the processor, so that it needs no graphics card, and every start has a profile of its own.
#[derive(Debug)]
pub struct Browser(());

/// A page after its scripts have run.
#[derive(Debug)]
pub struct Loaded {
    /// The page as the browser has it then.
    pub dom: String,
    /// Everything that the page wrote to the console, its errors included.
    pub console: Vec<String>,
}

impl Browser {
    /// The browser; says why there is none.
    ///
    /// # Panics
    /// If there is none and the environment says that there must be one, by [`REQUIRED`].
    #[must_use]
    pub fn find() -> Option<Self> {
        if runs(CHROMIUM, &["--version"]) {
            return Some(Browser(()));
        }
        let reason = format!("{CHROMIUM} is missing: apt-get install {CHROMIUM}");
        assert!(
            env::var(REQUIRED).is_err(),
            "{REQUIRED} is set, but {reason}"
        );
        eprintln!("skipped in the browser: {reason}");
        None
    }

    /// Opens a file and runs its scripts; `fragment` is what stands behind the `#` of its address.
    ///
    /// # Panics
    /// If the browser fails or hangs.
    #[must_use]
    pub fn load(&self, file: &Path, fragment: &str) -> Loaded {
        let (dom, log) = run(&["--dump-dom".as_ref()], file, fragment);
        let console = log.lines().filter(|line| line.contains(":CONSOLE"));
        Loaded {
            dom,
            console: console.map(str::to_owned).collect(),
        }
    }

    /// Takes a picture of a page in a window of this width and height in pixels.
    ///
    /// # Panics
    /// If the browser fails, hangs, or takes no picture.
    #[must_use]
    pub fn picture(&self, file: &Path, fragment: &str, size: [u32; 2]) -> Picture {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("picture.png");
        let [width, height] = size;
        let window = format!("--window-size={width},{height}");
        let screenshot = format!("--screenshot={}", path.display());
        let arguments = [window, screenshot, "--hide-scrollbars".into()];
        let arguments: Vec<&OsStr> = arguments.iter().map(AsRef::as_ref).collect();
        run(&arguments, file, fragment);
        Picture(fs::read(path).expect("a picture"))
    }
}

/// The bytes of a PNG file.
#[derive(Debug)]
pub struct Picture(pub Vec<u8>);

impl Loaded {
    /// The text of the element with this name, as it stood in the page.
    ///
    /// # Panics
    /// If there is no such element.
    #[must_use]
    pub fn text_of(&self, id: &str) -> String {
        let start = format!("id=\"{id}\"");
        let (_, rest) = self.dom.split_once(&start).expect("the element");
        let (_, rest) = rest.split_once('>').expect("its text");
        let (text, _) = rest.split_once("</").expect("its end");
        let text = text.replace("&lt;", "<").replace("&gt;", ">");
        text.replace("&nbsp;", " ").replace("&amp;", "&")
    }
}

/// Runs the browser on a file; what it prints, and its log.
fn run(arguments: &[&OsStr], file: &Path, fragment: &str) -> (String, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let profile = format!(
        "--user-data-dir={}",
        folder.path().join("profile").display()
    );
    // A page is larger than what a pipe holds while nobody reads it.
    let [printed, log] = ["printed", "log"].map(|name| folder.path().join(name));
    let [to_printed, to_log] = [&printed, &log].map(|path| File::create(path).expect("a file"));
    let file = fs::canonicalize(file).expect("the page");
    let child = Command::new(CHROMIUM)
        .args([
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu-sandbox",
            "--use-gl=angle",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--force-device-scale-factor=1",
            "--enable-logging=stderr",
            // Scripts get this much of their own time before the page counts as finished.
            "--virtual-time-budget=3000",
        ])
        .arg(profile)
        .args(arguments)
        .arg(format!("file://{}#{fragment}", file.display()))
        .stdin(Stdio::null())
        .stdout(to_printed)
        .stderr(to_log)
        .spawn()
        .expect("a browser that starts");
    let status = finish(child).status;
    let text = |path| String::from_utf8_lossy(&fs::read(path).expect("a file")).into_owned();
    let (dom, log) = (text(printed), text(log));
    assert!(status.success(), "{status}: {log}");
    (dom, log)
}
