// Plays the run that is in this file.
import * as THREE from './three.js';
import { BLOCK, KIND, ROLE, decodeReport } from './stream.js';
import { Viewer } from './viewer.js';
import { Panels, addButtons, element, kHelp, viewActions } from './panels.js';

// Forces on each body, frame by frame.
function forcesOf(statuses) {
  const names = new Set(statuses.flatMap((s) => (s?.bodies ?? []).map((b) => b.name)));
  return [...names].map((name) => [name, statuses.map((s) => s?.bodies.find((b) => b.name === name)?.force_N ?? 0)]);
}

export function start(buffer) {
  const messages = decodeReport(buffer), frames = messages.filter((m) => m.kind === KIND.frame);
  const panels = new Panels(), viewer = new Viewer(THREE, document.getElementById('view'));
  const setting = messages.find((m) => m.kind === KIND.setting), facts = setting.blocks[0].json;
  const summary = messages.find((m) => m.kind === KIND.summary).blocks[0].json;
  const play = { viewer, frames, at: 0, playing: false };
  window.tactus = play;  // for tests and the curious
  panels.setting(facts);
  panels.state('report');
  viewer.asked = facts.camera;
  viewer.dropSize_m = facts.liquid_spacing_m;
  if (!facts.show_cameras) viewer.hidden.add(ROLE.camera);
  viewer.show(setting);

  const slider = element('input', { type: 'range', min: 0, max: Math.max(0, frames.length - 1), step: 1, value: 0, 'aria-label': 'time' });
  const statusOf = (frame) => frame.blocks.find((b) => b.kind === BLOCK.json)?.json;
  const forces = new Map(forcesOf(frames.map(statusOf)));
  panels.series = (name) => (forces.get(name) ?? []).slice(0, play.at + 1).filter((_, i) => i % Math.ceil(frames.length / 240) === 0);
  const show = (i) => {
    play.at = Math.max(0, Math.min(frames.length - 1, i));
    const message = frames[play.at];
    if (!message) return;
    slider.value = play.at;
    viewer.show(message);
    panels.time(message, summary.frames);
    const status = statusOf(message);
    if (status) panels.status({ ...status, notices: [] });
    panels.notices(summary.notices);
  };
  const setPlaying = (playing) => {
    play.playing = playing;
    buttons.get(' ').textContent = playing ? 'Pause' : 'Play';
    if (playing && play.at === frames.length - 1) show(0);
    play.begun_ms = performance.now() - 1000 * ((frames[play.at]?.time_s ?? 0) - (frames[0]?.time_s ?? 0));
  };
  viewer.onFrame = () => {
    if (!play.playing) return;
    const time_s = frames[0].time_s + (performance.now() - play.begun_ms) / 1000;
    let next = play.at;
    while (next + 1 < frames.length && frames[next + 1].time_s <= time_s) ++next;
    if (next !== play.at) show(next);
    if (next === frames.length - 1) setPlaying(false);
  };
  const buttons = addButtons(viewer, [
    { key: ' ', label: 'Play', action: () => setPlaying(!play.playing) },
    { key: ',', label: '\u2039', title: 'key ,', action: () => { setPlaying(false); show(play.at - 1); } },
    { key: '.', label: '\u203a', title: 'key .', action: () => { setPlaying(false); show(play.at + 1); } },
    ...viewActions(viewer),
  ]);
  document.getElementById('bar').insertBefore(slider, buttons.get('r'));
  slider.addEventListener('input', () => { setPlaying(false); show(Number(slider.value)); });
  panels.help([['space', 'play, pause'], [', .', 'one frame back, on'], ...kHelp]);
  show(0);
}
