use super::*;
use crate::geometry::{Point, Vector};

const PLANE: &str = r#"{"format": "regulus-bspline", "version": 1, "units": "mm", "note": "own",
 "degree": [1, 1],
 "knots_u": [0, 0, 1, 1],
 "knots_v": [0, 0, 1, 1],
 "flip": false,
 "control": [[[0, 0, 0], [0, 10, 0]],
             [[20, 0, 0], [20, 10, 0]]]}"#;

fn open(text: &str, name: &str) -> Result<DesignSurface> {
    read(text.as_bytes(), name, &ReadOptions::default())
}

/// Message, line and column of a refusal.
fn refusal(text: &str, name: &str) -> (String, Option<usize>, Option<usize>) {
    let error = open(text, name).unwrap_err();
    assert!(error.help.is_some(), "no remedy: {error}");
    let place = error.place.unwrap();
    assert_eq!(place.file, name);
    (error.message, place.line, place.column)
}

#[track_caller]
fn assert_refused(text: &str, name: &str, words: &str, line: usize, column: usize) {
    let (message, at_line, at_column) = refusal(text, name);
    assert!(message.contains(words), "{message}");
    assert_eq!((at_line, at_column), (Some(line), Some(column)), "{message}");
}

fn top_normal(surface: &DesignSurface) -> Vector {
    surface.sample(1e9).samples[0].normal.0.into_inner()
}

#[test]
fn bspline_units_flip_and_placement() {
    let plane = open(PLANE, "a.json").unwrap();
    assert!((plane.area() - 200.0).abs() < 1e-12);
    assert!((top_normal(&plane) - Vector::z()).norm() < 1e-15);
    let inch = open(&PLANE.replace("\"mm\"", "\"inch\""), "a.json").unwrap();
    assert!((inch.area() - 200.0 * 25.4 * 25.4).abs() < 1e-9);
    assert!((top_normal(&open(&PLANE.replace("false", "true"), "a.json").unwrap()) + Vector::z()).norm() < 1e-15);
    let options = ReadOptions {
        units: Some(Units::Inches),
        flip: true,
        placement: RigidMotion::new(Vector::new(1.0, 2.0, 3.0), Vector::x() * std::f64::consts::FRAC_PI_2),
        triangles: Triangles::Flat,
    };
    // The file's own unit goes first; its flip and the job's cancel.
    let placed = read(PLANE.replace("false", "true").as_bytes(), "a.JSON", &options).unwrap();
    let corner = placed.sample(1e9).samples[1];
    assert!((corner.point - Point::new(1.0, 2.0, 13.0)).norm() < 1e-12);
    assert!((corner.normal.0.into_inner() + Vector::y()).norm() < 1e-12);
    let unitless = PLANE.replace("\"units\": \"mm\",", "");
    assert!((read(unitless.as_bytes(), "a.json", &options).unwrap().area() - 200.0 * 645.16).abs() < 1e-9);
}

#[test]
fn rational_weights_are_read() {
    let text = PLANE.replace("\"flip\"", "\"weights\": [[1, 2], [1, 2]], \"flip\"");
    let DesignSurface::Spline(spline) = open(&text, "a.json").unwrap() else { panic!("a spline") };
    assert!((spline.surface().point(0.5, 0.5) - Point::new(10.0, 20.0 / 3.0, 0.0)).norm() < 1e-12);
}

#[test]
fn bad_bsplines_are_located() {
    let name = "p.json";
    let change = |from: &str, to: &str| PLANE.replace(from, to);
    assert_refused(&change("[0, 10, 0]", "[0, NaN, 0]"), name, "expected value", 6, 30);
    assert_refused(&change("[0, 10, 0]", "[0, 1e999, 0]"), name, "out of range", 6, 34);
    assert_refused(&change("\"degree\": [1, 1]", "\"degree\": [1, 0]"), name, "degree 0", 2, 16);
    assert_refused(&change("\"knots_v\": [0, 0, 1, 1]", "\"knots_v\": [0, 0, 1]"), name, "there must be 4", 4, 13);
    assert_refused(&change("\"knots_u\": [0, 0, 1, 1]", "\"knots_u\": [0, 2, 1, 1]"), name, "knot 2 is 1", 3, 20);
    assert_refused(&change(",\n             [[20, 0, 0], [20, 10, 0]]", ""), name, "too few", 6, 13);
    assert_refused(&change("[20, 0, 0], ", ""), name, "row 1 has 1", 7, 14);
    assert_refused(&change("\"flip\"", "\"weights\": [[1, 1], [-1, 1]], \"flip\""), name, "weight [1][0] is -1", 5, 23);
    assert_refused(&change("\"flip\"", "\"weights\": [[1, 1], [1]], \"flip\""), name, "weights", 5, 22);
    assert_refused(&change("\"mm\"", "\"km\""), name, "\"km\"", 1, 54);
    assert_refused(&change("regulus-bspline", "other"), name, "regulus-bspline", 1, 12);
    assert_refused(&change("\"version\": 1", "\"version\": 2"), name, "version", 1, 42);
    assert_refused("{\"a\": 1}", name, "regulus-bspline", 1, 1);
    assert!(refusal(&change("\"knots_u\"", "\"knots\""), name).0.contains("missing field `knots_u`"));
    let (message, ..) = refusal(&change("[20, 0, 0], [20, 10, 0]", "[0, 0, 0], [0, 10, 0]"), name);
    assert!(message.contains("no normal at (u, v) = (0.000000, 0.000000)"), "{message}");
}

const GRID: &str = "i,j,x,y,z\n0,0,0,0,0\n0,1,0,5,0\n1,0,5,0,0\r\n1,1,5,5,0\n\n";

#[test]
fn grid_is_the_surface_through_its_points_in_any_order() {
    assert!((open(GRID, "g.csv").unwrap().area() - 25.0).abs() < 1e-12);
    let mut lines: Vec<&str> = GRID.lines().collect();
    lines[1..].reverse();
    assert!((top_normal(&open(&lines.join("\n"), "g.csv").unwrap()) - Vector::z()).norm() < 1e-12);
}

#[test]
fn bad_grids_are_located() {
    let name = "g.csv";
    let change = |from: &str, to: &str| GRID.replace(from, to);
    assert_refused(&change("1,0,5,0,0", "1,0,5,NaN,0"), name, "y is \"NaN\", which is not finite", 4, 7);
    assert_refused(&change("1,0,5,0,0", "1,0,5,0, 1x"), name, "z is \"1x\", which is not a number", 4, 10);
    assert_refused(&change("1,0,5,0,0", "1.0,0,5,0,0"), name, "i is \"1.0\"", 4, 1);
    assert_refused(&change("1,0,5,0,0", "1,0,5,0"), name, "4 values", 4, 1);
    assert_refused(&change("1,1,5,5,0", "0,1,5,5,0"), name, "i=0, j=1 is given twice", 5, 1);
    assert_refused(&change("i,j,x,y,z\n", ""), name, "header", 1, 1);
    assert!(refusal(&change("1,0,5,0,0\r\n", ""), name).0.contains("i=1, j=0 is missing"));
    assert!(refusal(&change("1,1,5,5,0", "1,3,5,5,0"), name).0.contains("i=0, j=2 is missing"));
    assert!(refusal(&change("1,1,5,5,0\n", ""), name).0.contains("i=1, j=1 is missing"));
    assert!(refusal(&change("1,0,5,0,0", "1000000000,0,5,0,0"), name).0.contains("i=1, j=0 is missing"));
    assert!(refusal("i,j,x,y,z\n", name).0.contains("no points"));
    assert!(refusal("", name).0.contains("empty"));
    assert!(refusal("h\n0,0,0,0,0\n0,1,1,0,0\n", name).0.contains("1 x 2"));
}

const ASCII: &str = "solid tet
facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 0 0\nendloop\nendfacet
facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nendloop\nendfacet
facet normal 0 0 0\nouter loop\nvertex 1 0 0\nvertex 0 1 0\nvertex 0 0 1\nendloop\nendfacet
facet normal 0 0 0\nouter loop\nvertex -0 0 0\nvertex 0 0 1\nvertex 0 1 0\nendloop\nendfacet
endsolid tet\n";

/// The same tetrahedron in binary, with a header that begins like text.
fn binary() -> Vec<u8> {
    let DesignSurface::Mesh(mesh) = open(ASCII, "t.stl").unwrap() else { panic!("a mesh") };
    let mut bytes = b"solid made by a careless writer".to_vec();
    bytes.resize(80, b' ');
    bytes.extend((mesh.triangles().len() as u32).to_le_bytes());
    for face in 0..mesh.triangles().len() {
        bytes.extend([0u8; 12]);
        for p in mesh.corners(face) {
            p.coords.iter().for_each(|x| bytes.extend((*x as f32).to_le_bytes()));
        }
        bytes.extend([0u8; 2]);
    }
    bytes
}

#[test]
fn stl_text_and_binary_are_the_same_closed_body() {
    for bytes in [ASCII.as_bytes().to_vec(), binary()] {
        let surface = read(&bytes, "t.stl", &ReadOptions::default()).unwrap();
        require_closed(&surface).unwrap();
        let DesignSurface::Mesh(mesh) = surface else { panic!("a mesh") };
        assert_eq!((mesh.vertices().len(), mesh.triangles().len()), (4, 4));
        assert!((mesh.signed_volume() - 1.0 / 6.0).abs() < 1e-12);
    }
}

#[test]
fn bodies_open_or_inside_out_are_refused_where_they_must_be_closed() {
    let options = ReadOptions { flip: true, ..ReadOptions::default() };
    let error = require_closed(&read(&binary(), "t.stl", &options).unwrap()).unwrap_err();
    assert!(error.message.contains("point inward") && error.help.unwrap().contains("invert"));
    let start = ASCII.rfind("facet normal").unwrap();
    let open_body = open(&format!("{}endsolid", &ASCII[..start]), "t.stl").unwrap();
    assert!(require_closed(&open_body).unwrap_err().message.contains("1 boundary loop,"));
    assert!(require_closed(&open(PLANE, "p.json").unwrap()).unwrap_err().message.contains("spline patch"));
}

#[test]
fn bad_stl_is_refused() {
    let name = "t.stl";
    let (message, line, _) = refusal(&ASCII.replacen("vertex 1 0 0", "vertex 1 zero 0", 1), name);
    assert!(message.contains("cannot be read"), "{message}");
    assert_eq!(line, Some(6));
    assert!(refusal("solid nothing\nendsolid nothing\n", name).0.contains("no triangles"));
    assert!(refusal(&ASCII.replacen("vertex 1 0 0", "vertex nan 0 0", 1), name).0.contains("finite"));
    assert!(refusal(&ASCII.replacen("vertex 1 0 0", "vertex 0 1 0", 1), name).0.contains("triangle 0"));
    // A second solid goes on counting lines.
    let two = format!("SOLID\n\n{}{ASCII}", &ASCII[10..]);
    let (message, line, _) = refusal(&format!("{}outer\n", &two[..two.rfind("outer loop").unwrap()]), name);
    assert!(message.contains("outer"), "{message}");
    assert_eq!(line, Some(31 + 1 + 3 * 7 + 2));
    assert!(refusal("short", name).0.contains("too short"));
    let cut = binary()[..200].to_vec();
    let error = read(&cut, name, &ReadOptions::default()).unwrap_err();
    assert!(error.message.contains("announces 4 triangles"), "{error}");
}

const OBJ: &str = "# own\nmtllib none.mtl\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 4 0 1\nv 4 2 1\no a\nf 1 2 3 4\ng b\nf 2/1/1 5 6 3\n";

#[test]
fn obj_groups_become_one_mesh() {
    let plain = OBJ.replace("2/1/1", "2");
    let DesignSurface::Mesh(mesh) = open(&plain, "o.obj").unwrap() else { panic!("a mesh") };
    assert_eq!((mesh.vertices().len(), mesh.triangles().len()), (6, 4));
    assert!(mesh.topology().is_disc());
    assert!((mesh.area() - 4.0 - 2.0 * 5.0f64.sqrt()).abs() < 1e-12);
}

#[test]
fn bad_obj_is_refused() {
    let (message, line, _) = refusal("v 0 0 0\nv 1 x 0\nf 1 2 3\n", "o.obj");
    assert!(message.contains("cannot be read"), "{message}");
    assert_eq!(line, Some(2));
    assert!(refusal("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9\n", "o.obj").0.contains("cannot be read"));
    assert!(refusal("v 0 0 0\n", "o.obj").0.contains("no triangles"));
    let against = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 4 3\n";
    let error = open(against, "o.obj").unwrap_err();
    assert!(error.message.contains("oriented against each other") && error.help.unwrap().contains("reorient"));
}

fn curved() -> ReadOptions {
    ReadOptions { triangles: Triangles::Curved { crease: Radians(0.5) }, ..ReadOptions::default() }
}

/// Two triangles of a cylinder of radius 5 about X, normals outward.
const ROUND: &str =
    "v 0 -3 4\nv 2 -3 4\nv 2 3 4\nv 0 3 4\nvn 0 -6 8\nvn 0 0.6 0.8\nf 1//1 2//1 3//2\nf 1//1 3//2 4//2\n";

#[test]
fn normals_of_an_obj_file_curve_its_triangles() {
    let top = |options: &ReadOptions| {
        let surface = read(ROUND.as_bytes(), "r.obj", options).unwrap();
        let foot = surface.foot(&(options.placement * Point::new(1.0, 0.1, 9.0)));
        assert!(matches!(surface, DesignSurface::Curved(_)));
        (foot.point, foot.normal.0.into_inner())
    };
    let (point, normal) = top(&curved());
    // The cubic over both edges, which turn by 74 degrees, rises to 4.72 of 5; flat it would stay at 4.
    assert!((point.z - 4.72).abs() < 0.01 && (normal - Vector::z()).norm() < 0.05, "{point} {normal}");
    let turn = RigidMotion::new(Vector::new(1.0, 2.0, 3.0), Vector::new(0.3, -0.4, 0.5));
    let (moved, turned) = top(&ReadOptions { flip: true, placement: turn, ..curved() });
    assert!((moved - turn * point).norm() < 1e-7 && (turned + turn * normal).norm() < 1e-6);
    // Without a word of curves, and without normals to go by, the triangles are flat.
    let height = |text: &str, options: &ReadOptions| {
        read(text.as_bytes(), "r.obj", options).unwrap().foot(&Point::new(1.0, 0.0, 9.0)).point.z
    };
    assert!((height(ROUND, &ReadOptions::default()) - 4.0).abs() < 1e-12);
    assert!((height(&ROUND.replace("//1", "").replace("//2", ""), &curved()) - 4.0).abs() < 1e-12);
}

#[test]
fn bad_normals_are_located() {
    let refused = |text: &str| {
        let error = read(text.as_bytes(), "r.obj", &curved()).unwrap_err();
        assert!(error.help.is_some());
        let place = error.place.unwrap();
        (error.message, place.file, place.line)
    };
    let (message, file, line) = refused(&ROUND.replace("4//2\n", "4\n"));
    assert!(message.contains("does not name a normal"), "{message}");
    assert_eq!((file.as_str(), line), ("r.obj", Some(8)));
    let (message, _, line) = refused(&ROUND.replace("vn 0 0.6 0.8", "vn 0 0 0"));
    assert!(message.contains("has no direction"), "{message}");
    assert_eq!(line, Some(7));
    let opposed = ROUND.replace("4//2\n", "4//3\n").replace("vn 0 -6 8\n", "vn 0 -6 8\nvn 0 0 1\nvn 0 -0.6 -0.8\n");
    let opposed = opposed.replace("3//2", "3//1");
    let (message, _, line) = refused(&opposed);
    assert!(message.contains("triangle 1") && message.contains("degrees from that of the triangle"), "{message}");
    assert_eq!(line, Some(10));
}

#[test]
fn bad_triangles_of_text_are_located() {
    let (message, line, _) =
        refusal(&ASCII.replacen("vertex 1 0 0\nvertex 0 1 0", "vertex 1 0 0\nvertex 1 0 0", 1), "t.stl");
    assert!(message.contains("triangle 2"), "{message}");
    assert_eq!(line, Some(16));
    let (message, line, _) = refusal("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nf 4 1 1\n", "o.obj");
    assert!(message.contains("triangle 2"), "{message}");
    assert_eq!(line, Some(6));
}

#[test]
fn unknown_kinds_and_encodings_are_refused() {
    assert!(refusal("", "part.xyz").0.contains(".xyz"));
    assert!(refusal("", "dir.stl/part").0.contains("no extension"));
    let error = read(b"i,j\n\xff", "g.csv", &ReadOptions::default()).unwrap_err();
    assert!(error.message.contains("UTF-8") && error.place.unwrap().line == Some(2));
}
