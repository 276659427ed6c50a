//! Hidden-line removal and the surface map of a walker of 14 parts.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::{DAffine3, DMat3, DVec2, DVec3};
use memo_core::Camera;
use memo_core::image::Window;
use memo_core::model::{EllipticCylinder, PreparedView, VisibilityOptions, surface_map, visible_contours};
use std::hint::black_box;

/// A cylinder from one end's centre to the other's, its x axis as near to `forward` as possible.
fn limb(bottom: DVec3, top: DVec3, forward: DVec3, a: f64, b: f64) -> EllipticCylinder {
    let z = (top - bottom).normalize();
    let y = z.cross(forward).normalize();
    let pose = DAffine3::from_mat3_translation(DMat3::from_cols(y.cross(z), y, z), (top + bottom) * 0.5);
    let half_length = (top - bottom).length() * 0.5;
    EllipticCylinder { world_from_cylinder: pose, semi_axes: DVec2::new(a, b), half_length }
}

/// Arm and leg of one side (y positive on the left), the leg swung forward by an angle.
fn push_side(side: f64, forward_rad: f64, parts: &mut Vec<EllipticCylinder>) {
    let down = |angle: f64| DVec3::new(angle.sin(), 0.0, -angle.cos());
    let mut chain = |mut top: DVec3, links: &[(f64, f64, f64, f64)]| {
        for &(angle, length, a, b) in links {
            let bottom = top + down(angle) * length;
            parts.push(limb(bottom, top, DVec3::X, a, b));
            top = bottom;
        }
        top
    };
    let (arm, leg) = (-0.7 * forward_rad, forward_rad);
    let arm_links = [(arm, 0.31, 0.05, 0.045), (arm + 0.3, 0.26, 0.04, 0.035), (arm + 0.3, 0.18, 0.04, 0.02)];
    chain(DVec3::new(0.0, 0.2 * side, 1.45), &arm_links);
    let leg_links = [(leg, 0.44, 0.085, 0.075), (leg - 0.25, 0.43, 0.055, 0.05)];
    let ankle = chain(DVec3::new(0.0, 0.09 * side, 0.93), &leg_links);
    parts.push(limb(ankle - DVec3::X * 0.06, ankle + DVec3::X * 0.2, DVec3::Z, 0.04, 0.045));
}

/// A man of 1.8 m at the origin, walking along +x.
fn walker(swing_rad: f64) -> Vec<EllipticCylinder> {
    let mut parts = vec![
        limb(DVec3::Z * 1.5, DVec3::Z * 1.8, DVec3::X, 0.10, 0.08),
        limb(DVec3::Z * 0.9, DVec3::Z * 1.5, DVec3::X, 0.11, 0.17),
    ];
    push_side(1.0, -swing_rad, &mut parts);
    push_side(-1.0, swing_rad, &mut parts);
    parts
}

/// Cameras at 6 m: from the side, from the front, obliquely.
fn viewpoints() -> [(&'static str, DVec3); 3] {
    [
        ("side", DVec3::new(0.3, -6.0, 1.2)),
        ("front", DVec3::new(6.0, 0.3, 1.2)),
        ("oblique", DVec3::new(4.2, -4.2, 1.8)),
    ]
}

fn hidden_lines(c: &mut Criterion) {
    let bodies: Vec<_> = (0..16).map(|i| walker(0.5 - f64::from(i) / 16.0)).collect();
    for (rims, what) in [(false, "28 lines"), (true, "28 lines and 28 end ellipses of 24 chords")] {
        let options = VisibilityOptions { rims, ..VisibilityOptions::default() };
        for (name, camera) in viewpoints() {
            let (mut view, mut out) = (PreparedView::default(), Vec::new());
            let mut next = bodies.iter().cycle();
            c.bench_function(&format!("hidden-line removal of 14 cylinders, {what}, {name}"), |b| {
                b.iter(|| {
                    let body = next.next().unwrap_or(&bodies[0]);
                    view.visible_contours(black_box(body), camera, &options, &mut out);
                    out.len()
                });
            });
        }
    }
    let (_, camera) = viewpoints()[0];
    let mut out = Vec::new();
    c.bench_function("hidden-line removal of 14 cylinders, 28 lines, side, without kept memory", |b| {
        b.iter(|| {
            visible_contours(black_box(&bodies[3]), camera, &VisibilityOptions::default(), &mut out);
            out.len()
        });
    });
}

/// A 640x480 camera 6 m to the side, in which the walker is 300 pixels high.
fn side_camera() -> Camera {
    let rotation = DMat3::from_cols(DVec3::X, -DVec3::Z, DVec3::Y).transpose();
    Camera {
        distortion: memo_core::model::Distortion::None,
        size: [640, 480],
        focal_px: DVec2::splat(1000.0),
        centre_px: DVec2::new(319.5, 239.5),
        rotation,
        translation: rotation * DVec3::new(0.0, 6.0, -0.9),
    }
}

fn surface(c: &mut Criterion) {
    let (body, camera) = (walker(0.4), side_camera());
    let around = Window { x: 220, y: 80, width: 200, height: 320 };
    for (window, what) in [(None, "640x480"), (Some(around), "a window of 200x320")] {
        c.bench_function(&format!("surface map of 14 cylinders, 300 px high, {what}"), |b| {
            b.iter(|| surface_map(black_box(&body), &camera, window));
        });
    }
}

criterion_group!(benches, hidden_lines, surface);
criterion_main!(benches);
