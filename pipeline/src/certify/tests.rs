use super::*;

/// A ring of `n` quadrilaterals between a circle of radius 0.9 and one of radius `inner` around `centre`, cut into
/// triangles, its boundary arcs bulging onto the circles.
fn ring(n: u32, inner: f64, centre: [f64; 2]) -> PlanarMap {
    let turn = |k: f64| (std::f64::consts::TAU * k / f64::from(n)).sin_cos();
    let outside = |k: f64| [0.9 * turn(k).1, 0.9 * turn(k).0];
    let inside = |k: f64| [centre[0] + inner * turn(k).1, centre[1] + inner * turn(k).0];
    let mut map = PlanarMap { cells: vec![], nodes: vec![], hole_centres: vec![GridPoint::vertex(centre)] };
    // Per sector six nodes: outer vertex, inner vertex, outer arc, inner arc, spoke, diagonal.
    for k in (0..n).map(f64::from) {
        let (a, b) = (GridPoint::vertex(outside(k)), GridPoint::vertex(inside(k)));
        let next = GridPoint::vertex(outside(k + 1.0));
        let arcs = [GridPoint::mid(outside(k + 0.5)), GridPoint::mid(inside(k + 0.5))];
        map.nodes.extend([a, b, arcs[0], arcs[1], a.midpoint(b), b.midpoint(next)]);
    }
    for k in 0..n {
        let (i, j) = (6 * k, 6 * ((k + 1) % n));
        map.cells.push([i, j, i + 1, i + 2, i + 5, i + 4]);
        map.cells.push([i + 1, j, j + 1, i + 5, j + 4, i + 3]);
    }
    map
}

#[test]
fn a_ring_is_certified_with_its_hole() {
    let proven = prove(ring(12, 0.4, [0.1, 0.05])).expect("valid");
    let certificate = proven.certificate();
    assert_eq!(certificate.by_bounds + certificate.by_exact, 24);
    assert_eq!((certificate.outer_arcs, certificate.hole_centres.len()), (12, 1));
    assert!(certificate.det_lower_bound > 0.0);
}

#[test]
fn a_folded_triangle_is_named() {
    let mut map = ring(12, 0.4, [0.1, 0.05]);
    map.nodes[6 * 5 + 5] = GridPoint::mid([0.0, 0.0]);
    let Err(Error::InvalidTriangles { all, .. }) = prove(map) else { panic!("folded") };
    assert_eq!(all, [FaceId(11)]);
}

#[test]
fn a_hole_that_is_not_seen_from_its_centre_is_proven_by_its_loop() {
    let mut map = ring(12, 0.4, [0.1, 0.05]);
    let argument = |map: &PlanarMap| prove(map.clone()).map(|proven| proven.certificate().boundary);
    assert_eq!(argument(&map), Ok(BoundaryArgument::StarShaped));
    map.hole_centres = vec![GridPoint::vertex([0.6, 0.0])];
    assert_eq!(argument(&map), Ok(BoundaryArgument::Simple));
    map.hole_centres.clear();
    let proven = prove(map).expect("its loops are simple");
    assert_eq!((proven.certificate().holes, proven.certificate().hole_centres.len()), (1, 0));
}

#[test]
fn a_map_that_winds_twice_is_refused() {
    // A ring of 12 sectors laid twice around the origin: every triangle is valid, and the map is two-to-one.
    let once = ring(6, 0.4, [0.0, 0.0]);
    let mut twice = once.clone();
    twice.nodes.extend(once.nodes);
    twice.cells.clear();
    for k in 0..12 {
        let (i, j) = (6 * k, 6 * ((k + 1) % 12));
        twice.cells.push([i, j, i + 1, i + 2, i + 5, i + 4]);
        twice.cells.push([i + 1, j, j + 1, i + 5, j + 4, i + 3]);
    }
    assert!(matches!(prove(twice), Err(Error::Boundary { .. })));
}

#[test]
fn a_spiral_ramp_of_two_turns_is_refused_and_one_of_less_than_a_turn_is_proven() {
    // Every jacobian is positive: only the boundary tells that the second turn lies on the first.
    let ramp = |sectors: u32| {
        let mut map = ring(8, 0.4, [0.0, 0.0]);
        map.hole_centres.clear();
        let once = map.nodes.clone();
        map.nodes.clear();
        map.cells.clear();
        for k in 0..=sectors {
            map.nodes.extend(&once[6 * (k as usize % 8)..][..6]);
        }
        for i in (0..sectors).map(|k| 6 * k) {
            let j = i + 6;
            map.cells.push([i, j, i + 1, i + 2, i + 5, i + 4]);
            map.cells.push([i + 1, j, j + 1, i + 5, j + 4, i + 3]);
        }
        map
    };
    let proven = prove(ramp(7)).expect("it does not come round");
    assert_eq!(proven.certificate().boundary, BoundaryArgument::Simple);
    assert_eq!((proven.certificate().outer_arcs, proven.certificate().holes), (16, 0));
    assert!(matches!(prove(ramp(8)), Err(Error::Boundary { .. })), "its ends touch");
    assert!(matches!(prove(ramp(16)), Err(Error::Boundary { .. })));
}

#[test]
fn cracks_pinches_and_shared_middles_are_found() {
    let sound = ring(8, 0.4, [0.0, 0.0]);
    let mut cracked = sound.clone();
    cracked.nodes.push(cracked.nodes[5]);
    cracked.cells[0][4] = 48;
    assert!(matches!(prove(cracked), Err(Error::Incidence(IncidenceError::Edge { .. }))));
    let mut shared = sound.clone();
    shared.cells[0][3] = shared.cells[2][3];
    assert!(matches!(prove(shared), Err(Error::Incidence(IncidenceError::Role { .. }))));
    let mut both = sound.clone();
    both.cells[0][3] = 6 * 4;
    assert!(matches!(prove(both), Err(Error::Incidence(IncidenceError::Role { .. }))));
    let mut turned = sound.clone();
    turned.cells[3] = [
        turned.cells[3][0],
        turned.cells[3][2],
        turned.cells[3][1],
        turned.cells[3][5],
        turned.cells[3][4],
        turned.cells[3][3],
    ];
    assert!(matches!(prove(turned), Err(Error::Incidence(_))));
    let mut missing = sound.clone();
    missing.cells[1][2] = 999;
    assert_eq!(prove(missing).map(|_| ()), Err(Error::Incidence(IncidenceError::Nodes { cell: FaceId(1) })));
    let mut pinched = sound;
    pinched.cells = vec![pinched.cells[0], pinched.cells[4]];
    let joined = pinched.cells[0][0];
    pinched.cells[1][0] = joined;
    assert!(matches!(prove(pinched), Err(Error::Incidence(IncidenceError::Pinched { .. }))));
}

#[test]
fn the_centre_of_a_star_is_found_where_there_is_one() {
    let centre = [0.1, 0.05];
    let map = ring(12, 0.4, centre);
    let loops = incidence::boundary_loops(&map.cells, map.nodes.len()).expect("sound");
    let hole: Vec<Arc> = loops[1].iter().map(|a| arcs::arc_of(a, &map.nodes)).collect();
    let far = GridPoint::vertex([0.9, 0.0]);
    let found = star_centre(&hole, far).expect("a disk is star-shaped");
    assert!(arcs::winds_once(&hole, found, -1));
    let mut dented = hole.clone();
    // Two opposite dents deeper than the middle leave no point that sees everything.
    for (i, to) in [(0, [0.0, 0.3]), (6, [0.2, -0.2])] {
        let p = GridPoint::vertex(to);
        dented[i].to = p;
        dented[(i + 1) % 12].from = p;
    }
    assert_eq!(star_centre(&dented, far), None);
}

#[test]
fn points_that_are_no_doubles_or_far_away_are_refused_before_any_arithmetic() {
    for x in [i64::MAX - 1, 1 << 58, (1 << 53) + 1, i64::MIN] {
        let mut map = ring(12, 0.4, [0.0, 0.0]);
        map.nodes[2].x = x;
        assert_eq!(prove(map).map(|_| ()), Err(Error::Inexact { node: 2 }), "{x}");
        let mut map = ring(12, 0.4, [0.0, 0.0]);
        map.hole_centres[0].y = x;
        assert_eq!(prove(map).map(|_| ()), Err(Error::InexactCentre { hole: 0 }), "{x}");
    }
}
