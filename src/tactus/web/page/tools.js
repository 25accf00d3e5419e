// What the mouse holds: tools of the scene (obstacles and blades with `held: true`), and tissue.
import { BLOCK, ROLE } from './stream.js';

// As in the window: a tool goes as fast as a hand; half of a blade's edge goes into the thing under the mouse, and it is put down in front of that.
const HAND_M_S = 0.5, DEEP = 0.5, CLEAR = 0.1;
// A grab that the server doesn't hear of for 2 s ends.
const AGAIN_MS = 500;

export function addTools(THREE, run) {
  const { viewer, setting } = run, { canvas, camera } = viewer;
  const ray = new THREE.Raycaster(), plane = new THREE.Plane(), at = new THREE.Vector3();
  run.poses = new Map();  // by name: position and quaternion that were sent last
  run.hand = 'turn';      // what a plain drag does: turn the view, grab, or hold the tool of this name
  let held = null;        // a tool: name, point under the mouse, and for blades how its edge lies

  const pose = (name) => {
    const known = run.poses.get(name), told = run.status.poses?.[name];
    if (known) return known;
    if (!told) return null;
    const made = { position: new THREE.Vector3(...told.position_m), quaternion: new THREE.Quaternion(...told.quaternion) };
    run.poses.set(name, made);
    return made;
  };
  run.poseOf = pose;
  run.sendPose = (name, more = {}) => {
    const { position, quaternion } = run.poses.get(name);
    run.send({ do: 'pose', obstacle: name, position_m: position.toArray(), quaternion: quaternion.normalize().toArray(), ...more });
  };
  const aim = (event) => {
    const r = canvas.getBoundingClientRect();
    ray.setFromCamera(new THREE.Vector2(2 * (event.clientX - r.left) / r.width - 1, 1 - 2 * (event.clientY - r.top) / r.height), camera);
  };
  const facing = () => camera.getWorldDirection(new THREE.Vector3());
  // The point under the mouse in the plane through `point` that faces the eye.
  const under = (event, point) => {
    aim(event);
    plane.setFromNormalAndCoplanarPoint(facing(), point);
    return ray.ray.intersectPlane(plane, at) ? at.clone() : null;
  };
  const things = (roles, names) => [...viewer.things.values()].filter((t) => t.kind === BLOCK.surface && roles.includes(t.role) && names.includes(t.name) && t.object.visible);
  // What is under the mouse, of these things: thing, point, and the nearest vertex.
  const pick = (event, among) => {
    aim(event);
    const hit = ray.intersectObjects(among.map((t) => t.object), false)[0];
    if (!hit) return null;
    const thing = among.find((t) => t.object === hit.object), far = (v) => viewer.vertex(thing, v).distanceTo(hit.point);
    return { thing, point: hit.point.clone(), vertex: [hit.face.a, hit.face.b, hit.face.c].reduce((a, b) => (far(b) < far(a) ? b : a)) };
  };

  addTissue(THREE, run);
  // A blade points away from the eye, so a drag across the picture cuts as deep as its tip is.
  const pointBlade = (name, tip) => {
    const blade = setting.blades[name], known = pose(name);
    const basis = (z, up) => {
      const x = new THREE.Vector3().crossVectors(up, z).normalize();
      return new THREE.Matrix4().makeBasis(x, new THREE.Vector3().crossVectors(z, x), z);
    };
    const from = new THREE.Vector3(...blade.from_m), edge = new THREE.Vector3(...blade.to_m).sub(from).normalize();
    const across = Math.abs(edge.y) < 0.9 ? new THREE.Vector3(0, 1, 0) : new THREE.Vector3(0, 0, 1);
    const away = camera.position.clone().sub(tip).normalize(), up = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 1);
    known.quaternion.setFromRotationMatrix(basis(away, up).multiply(basis(edge, across).transpose()));
    known.position.copy(tip).sub(from.applyQuaternion(known.quaternion));
  };
  const edgeOf = (name) => {
    const { from_m, to_m } = setting.blades[name];
    return Math.hypot(...to_m.map((x, i) => x - from_m[i]));
  };
  const takeBlade = (event, name) => {
    const hit = pick(event, things([ROLE.body], [...viewer.things.values()].map((t) => t.name)));
    if (!hit) return false;
    const toEye = camera.position.clone().sub(hit.point).normalize(), length_m = edgeOf(name);
    pointBlade(name, hit.point.clone().addScaledVector(toEye, CLEAR * length_m));
    run.sendPose(name, { put: true });
    held = { name, isBlade: true, point: hit.point.clone().addScaledVector(toEye, -DEEP * length_m) };
    follow(event);
    return true;
  };
  const takeTool = (event, name, point) => {
    held = { name, point };
    return true;
  };
  const follow = (event) => {
    const { position, quaternion } = pose(held.name);
    if (event.altKey && !held.isBlade) {
      const turn = (axis, angle) => quaternion.premultiply(new THREE.Quaternion().setFromAxisAngle(axis, angle));
      turn(new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 1), 0.01 * (event.clientX - held.x));
      turn(new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 0), 0.01 * (event.clientY - held.y));
    } else {
      const to = under(event, held.point);
      if (!to) return;
      held.isBlade ? pointBlade(held.name, to) : position.add(to).sub(held.point);
      held.point.copy(to);
    }
    [held.x, held.y] = [event.clientX, event.clientY];
    run.sendPose(held.name, { most_m_s: HAND_M_S });
  };

  viewer.grab = (event) => {
    if (event.button !== 0 || held || run.grasp || run.past?.seen) return false;
    const tool = setting.held.includes(run.hand) ? run.hand : setting.held[0];
    const hand = event.ctrlKey || event.metaKey ? 'grab' : event.shiftKey ? tool : run.hand;
    let isTaken = false;
    if (hand === 'grab') {
      const hit = pick(event, things([ROLE.body], setting.grabbed ?? []));
      if (hit) run.grabTissue(hit.thing, hit.point, hit.vertex);
      isTaken = Boolean(hit);
    } else if (setting.blades?.[hand] && pose(hand)) {
      isTaken = takeBlade(event, hand);
    } else {
      const hit = pick(event, things([ROLE.obstacle, ROLE.blade], setting.held));
      if (hit && pose(hit.thing.name)) isTaken = takeTool(event, hit.thing.name, hit.point);
      else if (setting.held.includes(hand) && pose(hand)) isTaken = takeTool(event, hand, pose(hand).position.clone());
    }
    if (!isTaken) return false;
    if (held) [held.x, held.y] = [event.clientX, event.clientY];
    if (held && hand !== 'turn') follow(event);
    canvas.setPointerCapture(event.pointerId);
    return true;
  };
  canvas.addEventListener('pointermove', (event) => {
    if (held) follow(event);
    if (!run.grasp) return;
    const to = under(event, run.grasp.target);
    if (to) run.pullTissue(to);
  });
  viewer.reach = (event) => {
    const step = facing().multiplyScalar(-0.0002 * event.deltaY * viewer.view.distance);
    if (run.grasp) run.pullTissue(run.grasp.target.clone().add(step));
    if (!held) return Boolean(run.grasp);
    pose(held.name).position.add(step);
    held.point.add(step);
    run.sendPose(held.name, { most_m_s: HAND_M_S });
    return true;
  };
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => { held = null; run.releaseTissue(); });
  // Keys: what a plain drag does, for those who have no ctrl and shift.
  run.nextHand = (button) => {
    const all = ['turn', ...(setting.grabbed?.length ? ['grab'] : []), ...setting.held];
    run.hand = all[(all.indexOf(run.hand) + 1) % all.length];
    button.textContent = `Hand: ${run.hand}`;
    canvas.style.cursor = run.hand === 'turn' ? '' : 'crosshair';
  };
}

// Tissue on a spring: from a vertex of a body to where it is pulled.
function addTissue(THREE, run) {
  const { viewer } = run;
  const line = new THREE.Line(new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3()]), new THREE.LineBasicMaterial({ color: 0x0072b2, depthTest: false }));
  const knob = new THREE.Mesh(new THREE.SphereGeometry(1, 12, 8), new THREE.MeshBasicMaterial({ color: 0x0072b2, depthTest: false, transparent: true }));
  for (const mark of [line, knob]) Object.assign(mark, { visible: false, frustumCulled: false, renderOrder: 1 });
  viewer.stage.add(line, knob);
  run.spring = line;
  let again = 0;
  const send = () => run.send({ do: 'grab', body: run.grasp.thing.name, point_m: run.grasp.point.toArray(), target_m: run.grasp.target.toArray() });
  run.grasp = null;
  run.grabTissue = (thing, point, vertex) => {
    run.grasp = { thing, point, vertex, target: point.clone() };
    send();
    again = setInterval(send, AGAIN_MS);
  };
  run.pullTissue = (target) => {
    run.grasp.target.copy(target);
    send();
  };
  run.releaseTissue = () => {
    if (!run.grasp) return;
    clearInterval(again);
    run.grasp = null;
    line.visible = knob.visible = false;
    viewer.changed = true;
    run.send({ do: 'release' });
  };
  const before = viewer.onFrame;
  viewer.onFrame = (frame) => {
    before?.(frame);
    if (!run.grasp) return;
    const { thing, vertex, target } = run.grasp, from = viewer.vertex(thing, Math.min(vertex, thing.block.count - 1)), points = line.geometry.attributes.position;
    points.setXYZ(0, ...from.toArray());
    points.setXYZ(1, ...target.toArray());
    points.needsUpdate = true;
    knob.position.copy(target);
    knob.scale.setScalar(0.008 * viewer.view.distance);
    line.visible = knob.visible = viewer.changed = true;
  };
}
