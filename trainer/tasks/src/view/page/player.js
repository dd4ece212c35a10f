// Which episode and which moment are shown, and what the user does about it.

const $ = (id) => document.getElementById(id);
const shown = { episode: 0, time: 0, playing: true, speed: 1, seconds: 0 };
let episode = null;

// A link may name the moment: #episode=2&step=100&pause
const wanted = new URLSearchParams(location.hash.slice(1));

// The ground, where the model has none: below everything that is seen first.
const SOLIDS = DATA.solids.slice();
if (!SOLIDS.some((solid) => solid.form === 'plane') && SOLIDS.length) {
  const lowest = Math.min(...SOLIDS.map((solid, k) => DATA.rest[k][2] - reachOf(solid)));
  SOLIDS.push({ name: '', form: 'plane', size: [0, 0, 0], colour: [0.5, 0.5, 0.5, 1] });
  DATA.rest.push([0, 0, lowest, 1, 0, 0, 0]);
}

const camera = { turn: 0.35, lift: 0.2, zoom: 1, pan: [0, 0, 0], radius: 1, path: null };

// Where the camera looks: it goes along with what moves, along each axis on which that goes far, and not too fast.
function cameraPath() {
  const count = DATA.moving.length;
  const centre = (frame) => [0, 1, 2].map((i) => {
    let sum = 0;
    for (let k = 0; k < count; k++) sum += episode.positions.at(frame * count + k, i);
    return sum / count;
  });
  const solids = count ? DATA.moving : DATA.solids.map((_, k) => k);
  const first = posesAt(episode, 0);
  const middle = count ? centre(0) : [0, 1, 2].map((i) => solids.reduce((sum, k) => sum + first[k][i], 0) / (solids.length || 1));
  const radius = (poses, from) => Math.max(1e-3, ...solids.map((k) => Math.hypot(...minus3(poses[k], from)) + reachOf(DATA.solids[k])));
  const start = radius(first, middle);
  camera.radius = start;
  const path = Array.from({ length: Math.max(episode.frames, 1) }, (_, frame) => (count ? centre(frame) : middle));
  const still = [false, false, false];
  for (let i = 0; i < 3; i++) {
    let [low, high] = [Infinity, -Infinity];
    for (const point of path) { low = Math.min(low, point[i]); high = Math.max(high, point[i]); }
    still[i] = high - low < 1.5 * start;
    const slow = Math.exp((-DATA.facts.period * DATA.stride) / 0.4);
    let last = path[0][i];
    for (const point of path) last = point[i] = still[i] ? (low + high) / 2 : last * slow + point[i] * (1 - slow);
    last = path[path.length - 1][i];
    // Once more backwards, so that it neither lags behind nor runs ahead.
    for (let k = path.length - 1; k >= 0; k--) last = path[k][i] = last * slow + path[k][i] * (1 - slow);
  }
  camera.path = path;
  // Far enough away for whatever swings out later, where the camera does not go along.
  for (let frame = 0; frame < path.length && count; frame += Math.ceil(path.length / 100)) {
    const from = centre(frame).map((x, i) => (still[i] ? path[frame][i] : x));
    camera.radius = Math.max(camera.radius, Math.min(radius(posesAt(episode, frame * DATA.stride), from), 3 * start));
  }
}

function cameraNow() {
  const place = Math.min(shown.time / DATA.stride, camera.path.length - 1);
  const [a, b] = [camera.path[Math.floor(place)], camera.path[Math.ceil(place)]];
  const part = place - Math.floor(place);
  const at = a.map((x, i) => x + (b[i] - x) * part + camera.pan[i]);
  const distance = 3.1 * camera.radius * camera.zoom;
  const flat = Math.cos(camera.lift) * distance;
  const eye = [at[0] + Math.sin(camera.turn) * flat, at[1] - Math.cos(camera.turn) * flat, at[2] + Math.sin(camera.lift) * distance];
  return { at, eye, distance, radius: camera.radius };
}

let drawing = null;
const trouble = (text) => { $('trouble').textContent = text; $('trouble').hidden = false; };
if (!DATA.solids.length) trouble('What this task looks like is not known. The plots show what happened.');
else {
  drawing = makeDrawing($('robot'));
  if (!drawing) trouble('This browser offers no WebGL 2, so the robot cannot be drawn. The plots need none.');
}

const stepNow = () => Math.max(0, Math.min(Math.floor(shown.time), episode.steps - 1));

// The steps that the plots show: all, or some seconds around now.
function spanNow() {
  if (!shown.seconds) return { from: 0, to: episode.steps };
  const width = Math.min(Math.max(4, Math.round(shown.seconds / DATA.facts.period)), episode.steps);
  const from = Math.max(0, Math.min(stepNow() - Math.floor(width / 2), episode.steps - width));
  return { from, to: from + width };
}

const actors = Math.max(...DATA.episodes.map((one) => one.actors), 0);
const stacks = [
  makeStack($('observation'), observationRows()),
  makeStack($('action'), actionRows()),
  makeStack($('reward'), rewardRows()),
  makeStack($('acted'), actedRows(actors)),
  makeStack($('bids'), bidRows()),
];

let drawnSpan = null;
function show() {
  const [step, span] = [stepNow(), spanNow()];
  const key = [shown.episode, span.from, span.to].join();
  for (const stack of stacks) {
    if (key !== drawnSpan) stack.still(episode, span);
    stack.live(episode, span, step);
  }
  drawnSpan = key;
  $('scrub').value = step;
  const seconds = (count) => (count * DATA.facts.period).toFixed(2);
  $('clock').textContent = `${seconds(step)} s · step ${step}`;
  $('play').textContent = shown.playing ? 'pause' : 'play';
  const poses = posesAt(episode, shown.time);
  const drawn = drawing ? drawing(SOLIDS, poses, cameraNow()) : null;
  if (!shown.playing) tell(step, poses, drawn);
}

// What is shown, for scripts.
function tell(step, poses, drawn) {
  const channels = (one) => Array.from({ length: one.channels }, (_, k) => one.at(step, k));
  $('state').textContent = JSON.stringify({
    episode: shown.episode,
    step,
    steps: episode.steps,
    observation: channels(episode.truth),
    seen: episode.seen ? channels(episode.seen) : null,
    blank: !!episode.blank[step],
    action: channels(episode.action),
    reward: episode.reward.at(step, 0),
    return_so_far: episode.returns[step],
    acted: Array.from({ length: episode.actors }, (_, k) => DATA.programs[actor(episode, step, k)]?.id ?? null),
    bids: Object.fromEntries(DATA.programs.map((one, k) => [one.id, DATA.wide ? Math.sinh(episode.bids.at(step, k)) : episode.bids.at(step, k)])),
    solids: DATA.solids.map((one, k) => ({ name: one.name, form: one.form, pose: poses[k] })),
    triangles: drawn ? drawn.triangles : 0,
    gl_error: drawn ? drawn.error : null,
    covered: drawn ? drawn.pixels() : 0,
  });
}

function choose(number) {
  shown.episode = number;
  episode = episodeOf(number);
  shown.time = 0;
  cameraPath();
  $('scrub').max = Math.max(episode.steps - 1, 0);
  [...$('episodes').children].forEach((button, k) => button.classList.toggle('shown', k === number));
}
function seek(step) {
  shown.time = Math.max(0, Math.min(step, episode.steps - 1));
  shown.playing = false;
  show();
}

$('title').textContent = `${DATA.facts.task} · ${DATA.facts.policy}`;
document.title = $('title').textContent;
$('facts').textContent = [
  DATA.facts.observability === 'none' ? 'sees everything' : DATA.facts.observability,
  ...DATA.facts.disturbances,
  `seed ${DATA.facts.seed}`,
  `${+(DATA.facts.period * 1000).toPrecision(4)} ms a step`,
  `tpg ${DATA.version}`,
].join(' · ');
const notes = [];
if (DATA.episodes.some((one) => bytesOf(one.blank).includes(1))) notes.push('shaded: the policy saw nothing');
if (DATA.episodes.some((one) => one.seen)) notes.push('blue: as the policy saw it, grey: as it was');
$('seen-note').textContent = notes.length ? '– ' + notes.join('; ') : '';
$('bids-note').textContent = DATA.bidders > DATA.programs.length ? `– of ${DATA.programs.length} programs of ${DATA.bidders}` : '';
DATA.episodes.forEach((one, k) => {
  const button = $('episodes').appendChild(document.createElement('button'));
  const end = one.unstable ? 'unstable' : one.terminated ? 'ended' : 'time limit';
  button.append(`episode ${k}`, document.createElement('br'), `${short(one.total)} · ${one.steps} steps · ${end}`);
  button.onclick = () => { choose(k); show(); };
});
const acts = DATA.programs.reduce((sum, one) => sum + one.acted, 0) || 1;
DATA.programs.forEach((one, k) => {
  const entry = $('legend').appendChild(document.createElement('span'));
  const mark = entry.appendChild(document.createElement('i'));
  mark.style.background = colourOf(k);
  const leads = one.actions ? ' → action ' + one.actions.join(', ') : '';
  entry.append(`p${one.id}${leads} · ${((100 * one.acted) / acts).toFixed(one.acted ? 1 : 0)} %`);
});
const longest = Math.max(...DATA.episodes.map((one) => one.steps)) * DATA.facts.period;
for (const seconds of [0, 10, 2, 0.5].filter((span) => span < longest)) {
  $('span').append(new Option(seconds ? `plots: ${seconds} s around now` : 'plots: whole episode', seconds));
}
$('span').onchange = (event) => { shown.seconds = +event.target.value; show(); };
$('speed').onchange = (event) => { shown.speed = +event.target.value; };
$('play').onclick = () => { shown.playing = !shown.playing; if (shown.playing && shown.time >= episode.steps - 1) shown.time = 0; show(); };
$('scrub').oninput = (event) => seek(+event.target.value);
for (const stack of stacks) {
  const go = (event) => { if (event.buttons) seek(stack.stepAt(event, spanNow())); };
  stack.element.onpointerdown = go;
  stack.element.onpointermove = go;
}
addEventListener('keydown', (event) => {
  if (event.target.tagName === 'SELECT') return;
  const keys = { ' ': () => $('play').click(), ArrowLeft: () => seek(stepNow() - 1), ArrowRight: () => seek(stepNow() + 1) };
  if (keys[event.key]) { event.preventDefault(); keys[event.key](); }
});
addEventListener('resize', () => { drawnSpan = null; show(); });

const robot = $('robot');
robot.onpointerdown = (event) => robot.setPointerCapture(event.pointerId);
robot.onpointermove = (event) => {
  if (!event.buttons) return;
  if (event.buttons === 1 && !event.shiftKey) {
    camera.turn -= event.movementX * 0.008;
    camera.lift = Math.max(0.02, Math.min(1.5, camera.lift + event.movementY * 0.008));
  } else {
    const size = (2.6 * camera.radius * camera.zoom) / robot.clientHeight;
    camera.pan[0] -= Math.cos(camera.turn) * event.movementX * size;
    camera.pan[1] -= Math.sin(camera.turn) * event.movementX * size;
    camera.pan[2] += event.movementY * size;
  }
  if (!shown.playing) show();
};
robot.oncontextmenu = (event) => event.preventDefault();
robot.addEventListener('wheel', (event) => {
  event.preventDefault();
  camera.zoom = Math.max(0.1, Math.min(8, camera.zoom * Math.exp(event.deltaY * 0.001)));
  if (!shown.playing) show();
}, { passive: false });
robot.ondblclick = () => { Object.assign(camera, { turn: 0.35, lift: 0.2, zoom: 1, pan: [0, 0, 0] }); show(); };

let last = performance.now();
function loop(now) {
  if (shown.playing) {
    shown.time += (Math.min(now - last, 100) / 1000 / DATA.facts.period) * shown.speed;
    if (shown.time >= episode.steps - 1) {
      // The next episode follows, after the last one the first.
      choose((shown.episode + 1) % DATA.episodes.length);
    }
    show();
  }
  last = now;
  requestAnimationFrame(loop);
}
choose(Math.max(0, Math.min(Math.floor(+wanted.get('episode')) || 0, DATA.episodes.length - 1)));
if (wanted.has('step')) shown.time = Math.max(0, Math.min(+wanted.get('step') || 0, episode.steps - 1));
shown.playing = !wanted.has('pause');
show();
requestAnimationFrame(loop);
