// The scene at its true size in a headset (WebXR). Controllers hold tools.
import { ROLE } from './stream.js';

// Where the middle of the scene is: above the floor and before the viewer [m].
const TABLE = [0, 1.0, -0.55];
// A controller takes the tool that is as near; from farther, the only tool comes to it.
const REACH_M = 0.15;
// And it grabs tissue that is as near.
const PINCH_M = 0.03;

export async function addVR(THREE, run, button) {
  const { viewer } = run, { renderer, stage } = viewer;
  const isThere = await navigator.xr?.isSessionSupported('immersive-vr').catch(() => false);
  button.disabled = !isThere;
  button.title = isThere ? 'key v' : !window.isSecureContext ? 'needs https or this computer (docs/web.md)' : 'this browser knows no headset';
  if (!isThere) return;
  renderer.xr.enabled = true;
  renderer.xr.setReferenceSpaceType('local-floor');
  const hands = [0, 1].map((i) => addHand(THREE, run, i));

  run.toggleVR = async () => {
    if (run.session) return run.session.end();
    try {
      run.session = await navigator.xr.requestSession('immersive-vr', { requiredFeatures: ['local-floor'] });
    } catch (error) {
      run.panels.say(`No headset: ${error.message}`, 'error');
      return;
    }
    const middle = viewer.view.target;
    stage.position.set(TABLE[0] - middle.x, TABLE[1] - middle.y, TABLE[2] - middle.z);
    run.session.addEventListener('end', () => {
      run.session = null;
      stage.position.set(0, 0, 0);
      for (const hand of hands) {
        hand.held = null;
        hand.letGo();
      }
      button.textContent = 'Enter VR';
      viewer.resize();
    });
    viewer.camera.near = 0.02;
    viewer.camera.far = 60;
    await renderer.xr.setSession(run.session);
    button.textContent = 'Leave VR';
  };
  const before = viewer.onFrame;
  viewer.onFrame = (frame) => {
    before?.(frame);
    for (const hand of hands) hand.move();
  };
}

function addHand(THREE, run, number) {
  const { viewer } = run, { stage, scene } = viewer;
  const controller = viewer.renderer.xr.getController(number);
  const rod = new THREE.Mesh(new THREE.CylinderGeometry(0.004, 0.008, 0.1), new THREE.MeshStandardMaterial({ color: 0x0072b2, roughness: 0.5 }));
  rod.rotation.x = Math.PI / 2;
  controller.add(rod);
  scene.add(controller);
  const hand = { controller, held: null, pulls: null };  // pulls: from the hand to where it pulls tissue
  // The controller in the scene's world.
  const poseNow = () => {
    controller.updateMatrixWorld(true);
    stage.updateMatrixWorld(true);
    return new THREE.Matrix4().copy(stage.matrixWorld).invert().multiply(controller.matrixWorld);
  };
  const toolNear = (T) => {
    const at = new THREE.Vector3().setFromMatrixPosition(T), tools = [...viewer.things.values()].filter((t) => [ROLE.obstacle, ROLE.blade].includes(t.role) && run.setting.held.includes(t.name));
    const distance = (t) => new THREE.Box3(new THREE.Vector3(...t.extent.min), new THREE.Vector3(...t.extent.max)).distanceToPoint(at);
    tools.sort((a, b) => distance(a) - distance(b));
    if (tools.length === 0) return null;
    const isNear = distance(tools[0]) < REACH_M;
    return isNear || tools.length === 1 ? { name: tools[0].name, isNear } : null;
  };
  controller.addEventListener('selectstart', () => {
    if (!run.setting.control) return;
    const T = poseNow(), tool = toolNear(T), pose = tool && run.poseOf(tool.name);
    if (!pose) return;
    const T_world_tool = new THREE.Matrix4().compose(pose.position, pose.quaternion, new THREE.Vector3(1, 1, 1));
    hand.held = { name: tool.name, T_hand_tool: tool.isNear ? T.clone().invert().multiply(T_world_tool) : new THREE.Matrix4() };
  });
  controller.addEventListener('selectend', () => { hand.held = null; });
  const handAt = () => new THREE.Vector3().setFromMatrixPosition(poseNow());
  controller.addEventListener('squeezestart', () => {
    if (!run.setting.control || run.grasp) return;
    const at = handAt();
    let nearest = null, distance = PINCH_M;
    for (const thing of viewer.things.values()) {
      if (thing.role !== ROLE.body || !run.setting.grabbed.includes(thing.name)) continue;
      for (let v = 0; v < thing.block.count; ++v) {
        const point = viewer.vertex(thing, v), d = point.distanceTo(at);
        if (d < distance) [nearest, distance] = [{ thing, point, vertex: v }, d];
      }
    }
    if (!nearest) return;
    run.grabTissue(nearest.thing, nearest.point, nearest.vertex);
    hand.pulls = nearest.point.clone().sub(at);
  });
  const letGo = () => {
    if (hand.pulls) run.releaseTissue();
    hand.pulls = null;
  };
  controller.addEventListener('squeezeend', letGo);
  hand.letGo = letGo;
  hand.move = () => {
    if (!run.session) return;
    if (hand.pulls && run.grasp) run.pullTissue(handAt().add(hand.pulls));
    if (!hand.held) return;
    const pose = run.poseOf(hand.held.name), size = new THREE.Vector3();
    poseNow().multiply(hand.held.T_hand_tool).decompose(pose.position, pose.quaternion, size);
    run.sendPose(hand.held.name);
  };
  return hand;
}
