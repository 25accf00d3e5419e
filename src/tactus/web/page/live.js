// Connects to a run and shows it.
import * as THREE from './three.js';
import { BLOCK, KIND, ROLE, decode } from './stream.js';
import { Viewer } from './viewer.js';
import { Panels, addButtons, addSliders, kHelp, viewActions } from './panels.js';
import { addPast } from './past.js';
import { addTools } from './tools.js';
import { addVR } from './vr.js';

const canvas = document.getElementById('view');
const panels = new Panels();
panels.state('connecting');
let viewer;
try {
  viewer = new Viewer(THREE, canvas);
} catch (error) {
  panels.say(`This browser draws no 3D (WebGL 2): ${error.message}`, 'error');
  throw error;
}
const run = { viewer, panels, setting: null, state: 'connecting', status: {}, socket: null, buttons: null, undrawn: 0, undrawn_s: null };
window.tactus = run;  // for tests and the curious
run.send = (message) => {
  if (run.socket?.readyState === WebSocket.OPEN) run.socket.send(JSON.stringify(message));
};

// From the capture of a frame's images until its picture is drawn [ms]. On other computers' clocks it means nothing.
const kAges = 240;
run.ages = [];
viewer.onDrawn = () => {
  // Frames come only as fast as they are drawn: else they would wait here, older and older.
  if (run.undrawn > 0) run.send({ do: 'got', frames: run.undrawn });
  run.undrawn = 0;
  if (run.undrawn_s === null) return;
  run.ages.push(Date.now() - 1000 * run.undrawn_s);
  run.undrawn_s = null;
  if (run.ages.length > kAges) run.ages.shift();
};

const token = new URLSearchParams(location.hash.slice(1)).get('token');
const address = `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/stream?ahead=2${token ? `&token=${encodeURIComponent(token)}` : ''}`;

function connect() {
  const socket = run.socket = new WebSocket(address);
  run.newest = undefined;
  run.undrawn = 0;
  socket.binaryType = 'arraybuffer';
  socket.onmessage = ({ data }) => (typeof data === 'string' ? takeText(JSON.parse(data)) : take(decode(data)));
  socket.onclose = () => {
    panels.state('lost');
    document.getElementById('time').textContent = run.state === 'ended' ? 'the run ended' : 'no connection: is the run over, or the address old?';
    setTimeout(connect, 1000);
  };
}

function takeText(json) {
  if (json.error) panels.say(json.error, 'error');
  if (!json.state) return;
  if (json.past && run.past && json.past.last < run.past.last) {  // the run went back
    run.poses?.clear();
    run.newest = json.past.last;
    panels.curves.clear();
  }
  run.state = json.state;
  run.past = json.past;
  panels.state(json.past?.seen ? 'past' : json.state);
  run.showPast?.();
  const pause = run.buttons?.get(' ');
  if (pause) pause.textContent = json.state === 'paused' ? 'Run' : 'Pause';
}

function take(message) {
  if (message.kind === KIND.setting) {
    const json = run.setting = message.blocks.find((b) => b.role === ROLE.setting).json;
    panels.setting(json);
    viewer.asked = json.camera;
    viewer.isFitted = false;
    viewer.dropSize_m = json.liquid_spacing_m;
    if (!json.show_cameras) viewer.hidden.add(ROLE.camera);
    addBar(json);
  }
  viewer.show(message);
  const status = message.blocks.find((b) => b.kind === BLOCK.json && b.role === ROLE.status)?.json;
  if (message.kind !== KIND.frame) return;
  if (status && JSON.stringify(status) !== run.statusText) {
    run.statusText = JSON.stringify(status);
    run.status = status;
    panels.status(status);
    panels.age(run.ages);
    if (status.parameters) run.sliders?.take(status.parameters);
  }
  run.frames = (run.frames ?? 0) + 1;
  ++run.undrawn;
  // The first after a connection may have waited there, and frames of the past have been drawn before.
  if (message.frame > run.newest) run.undrawn_s = message.captured_unix_s;
  run.newest = Math.max(run.newest ?? 0, message.frame);
  panels.time(message, run.status.frames_in_all);
}

function addBar(setting) {
  if (run.buttons) return;
  const holds = setting.control && (setting.held.length > 0 || setting.grabbed?.length > 0);
  const control = setting.control ? [
    { key: ' ', label: run.state === 'paused' ? 'Run' : 'Pause', action: () => run.send({ do: run.state === 'paused' ? 'run' : 'pause' }) },
    { key: '.', label: 'Step', action: () => run.send({ do: 'step' }) },
    ...(holds ? [{ key: 't', label: 'Hand: turn', title: 'key t: what a drag does', action: (button) => run.nextHand(button) }] : []),
  ] : [];
  run.buttons = addButtons(viewer, [...control, ...viewActions(viewer), { key: 'v', label: 'Enter VR', action: () => run.toggleVR?.() }]);
  addVR(THREE, run, run.buttons.get('v'));
  panels.help([...(setting.control ? [['space', 'pause, run'], ['.', 'one frame'], ['left, right, Home, End', 'frames that were seen'], ['b', 'simulate again from the frame shown']] : []),
    ...(holds && setting.held.length ? [['drag a tool', 'hold it; wheel: along the view; alt: turn'], ['shift drag', 'hold the tool, cut with a blade']] : []),
    ...(holds && setting.grabbed?.length ? [['ctrl drag', 'grab tissue and pull it']] : []), ...(holds ? [['t', 'what a plain drag does']] : []),
    ...kHelp.map(([keys, what]) => [holds && setting.held.length ? keys.replace(', shift drag', '') : keys, what]), ['v', 'headset']]);
  if (!setting.control) return;
  addTools(THREE, run);
  addPast(run);
  run.showPast();
  run.sliders = addSliders(setting.parameters ?? [], (parameter, value) => run.send({ do: 'set', parameter, value }));
}

connect();
