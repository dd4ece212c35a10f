//! What a task looks like: solids, and where they are.

/// The form of a solid. It is centred at its origin, and its axis is its own z.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Half the lengths along x and y, 0 for a plane without end; seen from the side to which z points.
    Plane,
    /// The radius.
    Sphere,
    /// The radius, then half the length of the straight part.
    Capsule,
    /// The three semi-axes.
    Ellipsoid,
    /// The radius, then half the length.
    Cylinder,
    /// Half the three lengths.
    Box,
    /// A mesh of [`Scene::meshes`], by its number; the sizes mean nothing.
    Mesh(usize),
}

/// One solid.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    /// What it is called; empty if it has no name.
    pub name: String,
    /// Its form, which says what `size` means.
    pub form: Form,
    /// In metres.
    pub size: [f32; 3],
    /// Red, green, blue and opacity, 0 to 1.
    pub colour: [f32; 4],
}

/// Triangles.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Corners, in metres.
    pub points: Vec<[f32; 3]>,
    /// Numbers of three corners for each triangle, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// The solids of a task, in a fixed order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scene {
    /// The solids.
    pub solids: Vec<Solid>,
    /// The meshes that solids name.
    pub meshes: Vec<Mesh>,
}

/// Where a solid is: z points up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Its origin, in metres.
    pub position: [f32; 3],
    /// How it is turned: a unit quaternion w, x, y, z.
    pub rotation: [f32; 4],
}

impl Pose {
    /// A solid that is not turned.
    #[must_use]
    pub const fn at(position: [f32; 3]) -> Self {
        Pose {
            position,
            rotation: [1.0, 0.0, 0.0, 0.0],
        }
    }

    /// A solid whose z axis leans by an angle in radians from up towards x.
    #[must_use]
    pub(crate) fn leaning(position: [f64; 3], angle: f64) -> Self {
        let (sin, cos) = libm::sincos(angle / 2.0);
        Pose {
            position: position.map(|x| x as f32),
            rotation: [cos as f32, 0.0, sin as f32, 0.0],
        }
    }
}

/// The colours of the tasks that are computed here: the part that a motor moves, the part that follows, what stands still.
pub(super) const DRIVEN: [f32; 4] = [0.16, 0.42, 0.72, 1.0];
/// See [`DRIVEN`].
pub(super) const FOLLOWING: [f32; 4] = [0.86, 0.45, 0.18, 1.0];
/// See [`DRIVEN`].
pub(super) const STILL: [f32; 4] = [0.55, 0.58, 0.63, 1.0];

/// A solid with a name, for a table of them.
pub(super) fn solid(name: &str, form: Form, size: [f32; 3], colour: [f32; 4]) -> Solid {
    Solid {
        name: name.into(),
        form,
        size,
        colour,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::{Acrobot, CartPole, Pendulum, Task};
    use std::f64::consts::PI;

    /// Where a point on a solid's own z axis lies in the world.
    fn on_axis(pose: Pose, z: f32) -> [f32; 3] {
        let [w, x, y, q] = pose.rotation;
        let axis = [
            2.0 * (x * q + w * y),
            2.0 * (y * q - w * x),
            1.0 - 2.0 * (x * x + y * y),
        ];
        std::array::from_fn(|i| pose.position[i] + z * axis[i])
    }

    fn close(a: [f32; 3], b: [f32; 3]) {
        assert!(
            a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5),
            "{a:?} {b:?}"
        );
    }

    fn poses(task: &dyn Task) -> (Scene, Vec<Pose>) {
        let (scene, mut poses) = (task.scene(), Vec::new());
        task.poses(&mut poses);
        assert_eq!(scene.solids.len(), poses.len());
        (scene, poses)
    }

    fn named(task: &dyn Task, name: &str) -> (Solid, Pose) {
        let (scene, poses) = poses(task);
        let index = scene.solids.iter().position(|solid| solid.name == name);
        let index = index.expect("a solid of this name");
        (scene.solids[index].clone(), poses[index])
    }

    /// The ends of a solid with a length along its axis.
    fn ends(task: &dyn Task, name: &str) -> [[f32; 3]; 2] {
        let (solid, pose) = named(task, name);
        [-solid.size[1], solid.size[1]].map(|z| on_axis(pose, z))
    }

    #[test]
    fn a_pole_leans_to_the_right_from_the_cart() {
        let mut task = CartPole::new();
        task.set_state([0.5, 0.0, PI / 2.0, 0.0]);
        let [foot, tip] = ends(&task, "pole");
        close(
            [tip[0] - foot[0], tip[1] - foot[1], tip[2] - foot[2]],
            [1.0, 0.0, 0.0],
        );
        assert!((foot[0] - 0.5).abs() < 1e-5);
    }

    #[test]
    fn the_links_of_an_acrobot_meet() {
        let mut task = Acrobot::new();
        task.set_state([0.4, -1.1, 0.0, 0.0]);
        let ([top, elbow], [joint, tip]) = (ends(&task, "link 1"), ends(&task, "link 2"));
        close(elbow, joint);
        // Hanging is the angle 0; the height of the tip is what Gymnasium's goal asks for.
        let height = -(0.4f32.cos()) - (0.4f32 - 1.1).cos();
        assert!((tip[2] - top[2] - height).abs() < 1e-5);
    }

    #[test]
    fn a_pendulum_of_angle_zero_stands() {
        let mut task = Pendulum::new();
        task.set_state([0.0, 0.0]);
        let [foot, tip] = ends(&task, "rod");
        close(
            [tip[0] - foot[0], tip[1] - foot[1], tip[2] - foot[2]],
            [0.0, 0.0, 1.0],
        );
    }
}
