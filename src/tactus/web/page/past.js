// The frames that were seen: a slider through them, and simulate again from any. As in the window.
import { element } from './panels.js';

// run.state and run.past are of the server: { first, last, seen, again_from, why_not_again } (docs/web.md).
export function addPast(run) {
  const { viewer } = run, panel = document.getElementById('past');
  const slider = element('input', { type: 'range', min: 1, max: 1, step: 1, value: 1, 'aria-label': 'frame that was seen' });
  const text = element('span', { class: 'number', role: 'status' });
  const button = (label, key, action) => {
    const made = element('button', { type: 'button', title: `key ${key}` }, label);
    made.addEventListener('click', () => { action(); viewer.canvas.focus(); });
    return made;
  };
  const step = (steps) => run.send({ do: 'see', steps }), see = (frame) => run.send({ do: 'see', frame });
  const actions = { ArrowLeft: () => step(-1), ArrowRight: () => step(1), Home: () => see(run.past?.first ?? 0), End: () => see(run.past?.last ?? 1e9),
    b: () => { if (!again.disabled) again.click(); } };
  const again = button('Simulate again', 'b', () => run.send({ do: 'again' }));
  panel.append(button('\u00ab', 'Home', actions.Home), button('\u2039', 'left', actions.ArrowLeft), slider, button('\u203a', 'right', actions.ArrowRight), button('\u00bb', 'End', actions.End), text, again);
  // A drag asks for the next frame when the last one is there.
  let asked = null, waits = false;
  const ask = () => {
    if (asked === null || waits) return;
    see(asked);
    asked = null;
    waits = true;
  };
  slider.addEventListener('input', () => { asked = Number(slider.value); ask(); });
  slider.addEventListener('change', () => viewer.canvas.focus());
  window.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === 'INPUT' || !actions[event.key] || !run.frames) return;
    event.preventDefault();
    actions[event.key]();
  });
  run.showPast = () => {
    waits = false;
    const past = run.past;
    panel.hidden = !past || run.state === 'running' || run.state === 'waiting';
    if (panel.hidden) return;
    const shown = past.seen ?? past.last;
    [slider.min, slider.max] = [past.first, past.last];
    if (asked === null) slider.value = shown;
    text.textContent = past.seen ? `frame ${shown} of ${past.first} to ${past.last}` : `frame ${shown}, the newest`;
    again.disabled = !past.again_from || Boolean(past.why_not_again);
    again.title = past.why_not_again ?? (past.seen ? `key b: the frames after ${past.again_from} are forgotten` : 'key b, from an older frame');
    ask();
  };
}
