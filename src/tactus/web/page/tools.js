// A tool of the scene (an obstacle or a blade with `held: true`) held by the mouse.
import { ROLE } from './stream.js';

export function addTools(THREE, run) {
  const { viewer, setting } = run, { canvas } = viewer;
  const ray = new THREE.Raycaster(), plane = new THREE.Plane(), at = new THREE.Vector3();
  run.poses = new Map();  // by name: position and quaternion that were sent last
  let held = null;

  const pose = (name) => {
    const known = run.poses.get(name), told = run.status.poses?.[name];
    if (known) return known;
    if (!told) return null;
    const made = { position: new THREE.Vector3(...told.position_m), quaternion: new THREE.Quaternion(...told.quaternion) };
    run.poses.set(name, made);
    return made;
  };
  run.poseOf = pose;
  run.sendPose = (name) => {
    const { position, quaternion } = run.poses.get(name);
    run.send({ do: 'pose', obstacle: name, position_m: position.toArray(), quaternion: quaternion.normalize().toArray() });
  };
  const aim = (event) => {
    const r = canvas.getBoundingClientRect();
    ray.setFromCamera(new THREE.Vector2(2 * (event.clientX - r.left) / r.width - 1, 1 - 2 * (event.clientY - r.top) / r.height), viewer.camera);
  };

  viewer.grab = (event) => {
    if (event.button !== 0 || event.shiftKey) return false;
    aim(event);
    const tools = [...viewer.things.values()].filter((t) => [ROLE.obstacle, ROLE.blade].includes(t.role) && setting.held.includes(t.name) && t.object.visible);
    const hit = ray.intersectObjects(tools.map((t) => t.object), false)[0];
    const tool = hit && tools.find((t) => t.object === hit.object);
    if (!tool || !pose(tool.name)) return false;
    held = { name: tool.name, point: hit.point.clone(), x: event.clientX, y: event.clientY };
    canvas.setPointerCapture(event.pointerId);
    return true;
  };
  canvas.addEventListener('pointermove', (event) => {
    if (!held) return;
    const { position, quaternion } = pose(held.name);
    if (event.ctrlKey) {
      const turn = (axis, angle) => quaternion.premultiply(new THREE.Quaternion().setFromAxisAngle(axis, angle));
      turn(new THREE.Vector3().setFromMatrixColumn(viewer.camera.matrixWorld, 1), 0.01 * (event.clientX - held.x));
      turn(new THREE.Vector3().setFromMatrixColumn(viewer.camera.matrixWorld, 0), 0.01 * (event.clientY - held.y));
    } else {
      aim(event);
      plane.setFromNormalAndCoplanarPoint(viewer.camera.getWorldDirection(new THREE.Vector3()), held.point);
      if (!ray.ray.intersectPlane(plane, at)) return;
      position.add(at).sub(held.point);
      held.point.copy(at);
    }
    [held.x, held.y] = [event.clientX, event.clientY];
    run.sendPose(held.name);
  });
  viewer.reach = (event) => {
    if (!held) return false;
    const step = viewer.camera.getWorldDirection(new THREE.Vector3()).multiplyScalar(-0.0002 * event.deltaY * viewer.view.distance);
    pose(held.name).position.add(step);
    held.point.add(step);
    run.sendPose(held.name);
    return true;
  };
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => { held = null; });
}
