// The data in the form in which it is used.

const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
const wordsOf = (text, Kind) => new Kind(bytesOf(text).buffer);

// Numbers over time. `at(step, channel)` is NaN where there is none.
function series(encoded) {
  const shares = wordsOf(encoded.shares, Uint16Array);
  const channels = encoded.low.length;
  return {
    channels,
    low: encoded.low,
    high: encoded.high,
    steps: channels ? shares.length / channels : 0,
    at(step, channel) {
      const share = shares[step * channels + channel];
      if (share === undefined || share === 65535) return NaN;
      const part = share / 65534;
      return encoded.low[channel] * (1 - part) + encoded.high[channel] * part;
    },
  };
}

// An episode is decoded when it is first looked at.
const decoded = new Map();
function episodeOf(number) {
  if (!decoded.has(number)) {
    const episode = DATA.episodes[number];
    const rewards = series(episode.reward);
    const returns = new Float64Array(episode.steps);
    for (let step = 0, sum = 0; step < episode.steps; step++) returns[step] = sum += rewards.at(step, 0);
    decoded.set(number, {
      steps: episode.steps,
      total: episode.total,
      truth: series(episode.truth),
      seen: episode.seen ? series(episode.seen) : null,
      blank: bytesOf(episode.blank),
      action: series(episode.action),
      reward: rewards,
      returns,
      bids: series(episode.bids),
      acted: wordsOf(episode.acted, Uint16Array),
      actors: episode.actors,
      frames: episode.poses.frames,
      positions: series(episode.poses.positions),
      rotations: wordsOf(episode.poses.rotations, Int16Array),
    });
  }
  return decoded.get(number);
}

// The program that gave an output in a step: its place in DATA.programs, or -1 if it is not shown.
function actor(episode, step, output) {
  const place = episode.acted[step * episode.actors + output];
  return place === undefined || place === 65535 ? -1 : place;
}

// Where solids are at a time, which is counted in steps and may lie between two: seven numbers for each.
function posesAt(episode, time) {
  const poses = DATA.rest.map((pose) => pose.slice());
  const last = episode.frames - 1;
  const place = Math.min(Math.max(time / DATA.stride, 0), last);
  const [a, b] = [Math.floor(place), Math.min(Math.floor(place) + 1, last)];
  const part = place - a;
  const count = DATA.moving.length;
  DATA.moving.forEach((solid, k) => {
    const pose = poses[solid];
    const [p, q] = [a * count + k, b * count + k];
    for (let i = 0; i < 3; i++) {
      const [from, to] = [episode.positions.at(p, i), episode.positions.at(q, i)];
      pose[i] = from + (to - from) * part;
    }
    // Two quaternions stand for each rotation; the nearer one gives the shorter way.
    let dot = 0;
    for (let i = 0; i < 4; i++) dot += episode.rotations[p * 4 + i] * episode.rotations[q * 4 + i];
    const sign = dot < 0 ? -1 : 1;
    let length = 0;
    for (let i = 0; i < 4; i++) {
      const value = episode.rotations[p * 4 + i] * (1 - part) + sign * episode.rotations[q * 4 + i] * part;
      pose[3 + i] = value;
      length += value * value;
    }
    length = Math.sqrt(length) || 1;
    for (let i = 3; i < 7; i++) pose[i] /= length;
  });
  return poses;
}

const COLOURS = ['#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9', '#8c564b', '#7f3fbf', '#b8860b', '#2f8f8f', '#c44569', '#6b7a3a'];
const colourOf = (program) => (program < 0 ? '#8a93a3' : COLOURS[program % COLOURS.length]);

// A number in few characters.
function short(value) {
  if (!Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e6 || size < 1e-3)) return value.toExponential(1).replace('+', '').replaceAll('-', '−');
  const digits = size >= 1000 ? 0 : size >= 100 ? 1 : size >= 10 ? 2 : 3;
  return value.toFixed(digits).replace('-', '−');
}
