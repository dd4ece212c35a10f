//! What a MuJoCo model looks like: its geoms.
//!
//! Drawn are the geoms of the groups that MuJoCo's own viewer shows at first. Sites, tendons, skins and textures are left out.

use super::custom::names::names;
use crate::task::{Form, Mesh, Pose, Scene, Solid};
use mujoco_rs::prelude::{MjData, MjModel};
use mujoco_rs::wrappers::mj_model::MjtGeomBase;
use std::sync::Arc;

/// The groups of geoms that MuJoCo's viewer shows at first.
const SHOWN: std::ops::Range<i32> = 0..3;
/// The colour of a geom that names none, in the model's tables.
const UNNAMED: [f32; 4] = [0.5, 0.5, 0.5, 1.0];
/// Points of a height field along each side above which it is thinned out.
const FIELD_POINTS: usize = 200;

/// The solids of a model.
pub(super) fn scene(model: &MjModel) -> Scene {
    let meshes = model.mesh_vertadr().len();
    let mut scene = Scene {
        solids: Vec::new(),
        meshes: (0..meshes).map(|index| mesh(model, index)).collect(),
    };
    let fields = model.hfield_nrow().len();
    (scene.meshes).extend((0..fields).map(|index| height_field(model, index)));
    let mut used = vec![false; scene.meshes.len()];
    let geom_names = names(model, model.name_geomadr());
    for index in shown(model) {
        let data = usize::try_from(model.geom_dataid()[index]);
        let form = match (model.geom_type()[index], data) {
            (MjtGeomBase::mjGEOM_PLANE, _) => Form::Plane,
            (MjtGeomBase::mjGEOM_SPHERE, _) => Form::Sphere,
            (MjtGeomBase::mjGEOM_CAPSULE, _) => Form::Capsule,
            (MjtGeomBase::mjGEOM_ELLIPSOID, _) => Form::Ellipsoid,
            (MjtGeomBase::mjGEOM_CYLINDER, _) => Form::Cylinder,
            (MjtGeomBase::mjGEOM_BOX, _) => Form::Box,
            (MjtGeomBase::mjGEOM_HFIELD, Ok(field)) => Form::Mesh(meshes + field),
            // A signed distance field has a mesh to show.
            (_, Ok(mesh)) => Form::Mesh(mesh),
            // `shown` leaves out what has no form.
            (_, Err(_)) => Form::Sphere,
        };
        if let Form::Mesh(mesh) = form
            && let Some(used) = used.get_mut(mesh)
        {
            *used = true;
        }
        scene.solids.push(Solid {
            name: geom_names[index].into(),
            form,
            size: model.geom_size()[index].map(|x| x as f32),
            colour: colour(model, index),
        });
    }
    // A mesh that only hidden geoms use need not be kept.
    for (mesh, used) in scene.meshes.iter_mut().zip(used) {
        if !used {
            *mesh = Mesh::default();
        }
    }
    scene
}

/// Where the solids of the model are.
///
/// As MuJoCo computed them last, so one step of physics before the state: to compute them anew would change what the next
/// step starts from.
pub(super) fn poses(data: &MjData<Arc<MjModel>>, poses: &mut Vec<Pose>) {
    let (positions, rotations) = (data.geom_xpos(), data.geom_xmat());
    poses.extend(shown(data.model()).map(|index| Pose {
        position: positions[index].map(|x| x as f32),
        rotation: quaternion(&rotations[index]).map(|x| x as f32),
    }));
}

/// The geoms that are drawn, in the model's order.
fn shown(model: &MjModel) -> impl Iterator<Item = usize> {
    (0..model.geom_type().len()).filter(|&index| {
        let formless = matches!(
            model.geom_type()[index],
            MjtGeomBase::mjGEOM_HFIELD | MjtGeomBase::mjGEOM_MESH | MjtGeomBase::mjGEOM_SDF
        ) && model.geom_dataid()[index] < 0;
        SHOWN.contains(&model.geom_group()[index]) && !formless && colour(model, index)[3] > 0.0
    })
}

/// A geom's colour: its own, or its material's where it has none.
fn colour(model: &MjModel, geom: usize) -> [f32; 4] {
    let own = model.geom_rgba()[geom];
    let material = usize::try_from(model.geom_matid()[geom]).ok();
    match material.and_then(|material| model.mat_rgba().get(material)) {
        Some(colour) if own.map(f32::to_bits) == UNNAMED.map(f32::to_bits) => *colour,
        _ => own,
    }
}

/// The part of a table that an object has, by the table of its first rows and that of their number.
fn part<'a, T>(table: &'a [T], first: &[i32], number: &[i32], index: usize) -> &'a [T] {
    let first = usize::try_from(first[index]).unwrap_or(0);
    let number = usize::try_from(number[index]).unwrap_or(0);
    table.get(first..first + number).unwrap_or_default()
}

fn mesh(model: &MjModel, index: usize) -> Mesh {
    let (vertices, faces) = (model.mesh_vertadr(), model.mesh_faceadr());
    let points = part(model.mesh_vert(), vertices, model.mesh_vertnum(), index);
    let faces = part(model.mesh_face(), faces, model.mesh_facenum(), index);
    let corner = |corner: i32| u32::try_from(corner).unwrap_or(0);
    Mesh {
        points: points.to_vec(),
        triangles: faces.iter().map(|face| face.map(corner)).collect(),
    }
}

/// The surface of a height field.
fn height_field(model: &MjModel, index: usize) -> Mesh {
    let count = |table: &[i32]| usize::try_from(table[index]).unwrap_or(0);
    let (rows, columns) = (count(model.hfield_nrow()), count(model.hfield_ncol()));
    let first = count(model.hfield_adr());
    let heights = model.hfield_data().get(first..first + rows * columns);
    let Some(heights) = heights.filter(|_| rows > 1 && columns > 1) else {
        return Mesh::default();
    };
    let [x, y, top, _] = model.hfield_size()[index].map(|x| x as f32);
    let (along_y, along_x) = (thinned(rows), thinned(columns));
    let place = |k: usize, n: usize, half: f32| half * (2.0 * k as f32 / (n - 1) as f32 - 1.0);
    let mut mesh = Mesh::default();
    for &row in &along_y {
        for &column in &along_x {
            let height = top * heights[row * columns + column];
            (mesh.points).push([place(column, columns, x), place(row, rows, y), height]);
        }
    }
    let width = along_x.len();
    for row in 1..along_y.len() {
        for column in 1..width {
            let at = |row: usize, column: usize| (row * width + column) as u32;
            let [a, b] = [at(row - 1, column - 1), at(row - 1, column)];
            let [c, d] = [at(row, column - 1), at(row, column)];
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    mesh
}

/// Numbers of the points that stay of so many: all, or evenly spread ones with both ends among them.
fn thinned(points: usize) -> Vec<usize> {
    let stay = points.min(FIELD_POINTS);
    (0..stay).map(|k| k * (points - 1) / (stay - 1)).collect()
}

/// The unit quaternion w, x, y, z of a rotation matrix, given row by row.
fn quaternion(m: &[f64; 9]) -> [f64; 4] {
    // The greatest of the four by its square, so that nothing small divides.
    let squares = [
        1.0 + m[0] + m[4] + m[8],
        1.0 + m[0] - m[4] - m[8],
        1.0 - m[0] + m[4] - m[8],
        1.0 - m[0] - m[4] + m[8],
    ];
    let greatest = (0..4).fold(0, |a, b| if squares[b] > squares[a] { b } else { a });
    let double = squares[greatest].max(0.0).sqrt();
    let scaled = match greatest {
        0 => [double * double, m[7] - m[5], m[2] - m[6], m[3] - m[1]],
        1 => [m[7] - m[5], double * double, m[1] + m[3], m[2] + m[6]],
        2 => [m[2] - m[6], m[1] + m[3], double * double, m[5] + m[7]],
        _ => [m[3] - m[1], m[2] + m[6], m[5] + m[7], double * double],
    };
    scaled.map(|x| x / (2.0 * double))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::create;
    use crate::task::mujoco::sim::compile;

    const MODEL: &str = r#"<mujoco>
        <asset>
            <material name="red" rgba="1 0 0 1"/>
            <hfield name="hill" nrow="2" ncol="3" size="1 2 0.5 0.1" elevation="0 0 0 1 1 0"/>
            <mesh name="corner" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/>
        </asset>
        <worldbody>
            <geom name="ground" type="plane" size="0 0 1"/>
            <geom name="terrain" type="hfield" hfield="hill"/>
            <geom name="shape" type="mesh" mesh="corner" material="red"/>
            <geom name="hidden" type="sphere" size="1" group="3"/>
            <geom name="clear" type="sphere" size="1" rgba="1 1 1 0"/>
            <body euler="0 90 0" pos="1 2 3"><geom name="bar" type="capsule" size="0.1 0.4" rgba="0 1 0 1"/></body>
        </worldbody>
    </mujoco>"#;

    #[test]
    fn a_model_is_drawn_as_its_viewer_shows_it() {
        let model = compile(|| MjModel::from_xml_string(MODEL)).unwrap();
        let scene = scene(&model);
        let names: Vec<&str> = scene.solids.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, ["ground", "terrain", "shape", "bar"]);
        let [ground, terrain, shape, bar] = &scene.solids[..] else {
            panic!("{names:?}")
        };
        assert_eq!(ground.form, Form::Plane);
        assert_eq!((terrain.form, shape.form), (Form::Mesh(1), Form::Mesh(0)));
        assert_eq!(
            shape.colour.map(f32::to_bits),
            [1.0f32, 0.0, 0.0, 1.0].map(f32::to_bits)
        );
        assert_eq!(bar.form, Form::Capsule);
        assert_eq!(scene.meshes[0].triangles.len(), 4);
        let hill = &scene.meshes[1];
        assert_eq!((hill.points.len(), hill.triangles.len()), (6, 4));
        // The first row of the text is the farthest along y.
        assert_eq!(
            [hill.points[0], hill.points[3]].map(|point| point.map(f32::to_bits)),
            [[-1.0f32, -2.0, 0.5], [-1.0, 2.0, 0.0]].map(|point| point.map(f32::to_bits))
        );
        let mut data = MjData::new(Arc::clone(&model));
        data.forward();
        let mut found = Vec::new();
        poses(&data, &mut found);
        assert_eq!(found.len(), 4);
        assert_eq!(
            found[3].position.map(f32::to_bits),
            [1.0f32, 2.0, 3.0].map(f32::to_bits)
        );
        let half = std::f32::consts::FRAC_1_SQRT_2;
        for (found, expected) in found[3].rotation.iter().zip([half, 0.0, half, 0.0]) {
            assert!((found - expected).abs() < 1e-6);
        }
    }

    #[test]
    fn quaternions_are_those_of_half_turns_too() {
        for (diagonal, expected) in [
            ([1.0, 1.0, 1.0], [1.0, 0.0, 0.0, 0.0]),
            ([1.0, -1.0, -1.0], [0.0, 1.0, 0.0, 0.0]),
            ([-1.0, 1.0, -1.0], [0.0, 0.0, 1.0, 0.0]),
            ([-1.0, -1.0, 1.0], [0.0, 0.0, 0.0, 1.0]),
        ] {
            let [a, b, c] = diagonal;
            let found = quaternion(&[a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, c]);
            assert_eq!(found.map(f64::to_bits), expected.map(f64::to_bits));
        }
    }

    #[test]
    fn every_robot_has_solids_and_asking_for_them_changes_nothing() {
        use crate::task::Rng;
        for name in [
            "hopper",
            "half-cheetah",
            "ant",
            "humanoid",
            "reacher",
            "pusher",
        ] {
            let run = |draw: bool| {
                let mut task = create(name).unwrap();
                task.reset(&mut Rng::new(1));
                let mut seen = vec![0.0; task.spec().inputs.len()];
                for _ in 0..5 {
                    if draw {
                        let mut poses = Vec::new();
                        task.poses(&mut poses);
                        assert_eq!(poses.len(), task.scene().solids.len());
                        assert!(poses.len() > 3, "{name}");
                    }
                    task.step(tpg_runtime::Action::Continuous(&[0.3; 17]));
                }
                task.observe(&mut seen);
                seen.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
            };
            assert_eq!(run(true), run(false), "{name}");
        }
    }
}
