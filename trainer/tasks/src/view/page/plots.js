// Plots over the steps of an episode. What does not change while it plays is drawn once, and the rest on a sheet above it.

const LABEL = 148;
const VALUE = 62;
const TEXT = '11px system-ui, sans-serif';
const shadeOf = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// A stack of rows in an element; each row has a height and paints itself.
function makeStack(element, rows) {
  const sheets = ['still', 'live'].map(() => element.appendChild(document.createElement('canvas')));
  const height = rows.reduce((sum, row) => sum + row.height, 0);
  const prepare = (sheet) => {
    const ratio = Math.min(devicePixelRatio, 2);
    const width = Math.max(element.clientWidth, LABEL + VALUE + 20);
    sheet.width = width * ratio;
    sheet.height = height * ratio;
    sheet.style.height = height + 'px';
    const pen = sheet.getContext('2d');
    pen.scale(ratio, ratio);
    pen.font = TEXT;
    pen.textBaseline = 'middle';
    return [pen, width];
  };
  const across = (span, width) => {
    const room = width - LABEL - VALUE;
    return (step) => LABEL + ((step - span.from) / Math.max(span.to - span.from, 1)) * room;
  };
  return {
    element,
    still(episode, span) {
      const [pen, width] = prepare(sheets[0]);
      let top = 0;
      for (const row of rows) {
        row.paint({ pen, episode, span, top, height: row.height, left: LABEL, right: width - VALUE, x: across(span, width) });
        top += row.height;
      }
    },
    live(episode, span, step) {
      const [pen, width] = prepare(sheets[1]);
      const at = across(span, width)(step + 0.5);
      pen.strokeStyle = shadeOf('--accent');
      pen.beginPath();
      pen.moveTo(at, 0);
      pen.lineTo(at, height);
      pen.stroke();
      let top = 0;
      pen.fillStyle = shadeOf('--text');
      for (const row of rows) {
        pen.fillText(row.value(episode, step), width - VALUE + 6, top + row.height / 2, VALUE - 6);
        top += row.height;
      }
    },
    stepAt(event, span) {
      const box = element.getBoundingClientRect();
      const share = (event.clientX - box.left - LABEL) / (box.width - LABEL - VALUE);
      return Math.floor(span.from + share * (span.to - span.from));
    },
  };
}

// What stands to the left of a row, and a line below it.
function heading({ pen, top, height, right }, name, unit) {
  pen.fillStyle = shadeOf('--text');
  pen.fillText(name, 0, top + height / 2, LABEL - 8);
  const used = Math.min(pen.measureText(name).width, LABEL - 8) + 5;
  if (unit && unit !== '1' && used < LABEL - 24) {
    pen.fillStyle = shadeOf('--faint');
    pen.fillText(unit, used, top + height / 2, LABEL - used - 6);
  }
  pen.strokeStyle = shadeOf('--line');
  pen.beginPath();
  pen.moveTo(LABEL, top + height - 0.5);
  pen.lineTo(right, top + height - 0.5);
  pen.stroke();
}

// Shades the steps in which the policy saw nothing.
function shadeBlank({ pen, episode, span, top, height, x }) {
  pen.fillStyle = shadeOf('--shade');
  for (let step = span.from; step < span.to; step++) {
    if (!episode.blank[step]) continue;
    let end = step;
    while (end < span.to && episode.blank[end]) end++;
    pen.fillRect(x(step), top, Math.max(x(end) - x(step), 0.5), height);
    step = end;
  }
}

// A curve over the steps of the span. Where there are many steps for a pixel, it shows the least and the greatest of them.
function curve({ pen, span, top, height, left, right, x }, value, low, high, colour) {
  const middle = low === high ? 0.5 : 0;
  const y = (v) => top + height - 3 - (middle || (v - low) / (high - low)) * (height - 6);
  pen.strokeStyle = pen.fillStyle = colour;
  pen.lineWidth = 1.2;
  if (span.to - span.from > 2 * (right - left)) {
    for (let pixel = Math.floor(left); pixel < right; pixel++) {
      const step = (at) => Math.floor(span.from + ((at - left) / (right - left)) * (span.to - span.from));
      let [least, greatest] = [Infinity, -Infinity];
      for (let k = step(pixel); k < step(pixel + 1); k++) {
        const v = value(k);
        if (v < least) least = v;
        if (v > greatest) greatest = v;
      }
      if (least <= greatest) pen.fillRect(pixel, y(greatest) - 0.5, 1, y(least) - y(greatest) + 1);
    }
    return;
  }
  pen.beginPath();
  let before = false;
  for (let step = span.from; step < span.to; step++) {
    const v = value(step);
    if (Number.isNaN(v)) { before = false; continue; }
    if (before) pen.lineTo(x(step + 0.5), y(v));
    else { pen.moveTo(x(step + 0.5) - 0.6, y(v)); pen.lineTo(x(step + 0.5), y(v)); }
    before = true;
  }
  pen.stroke();
}

const observationRows = () => DATA.inputs.map((input, k) => ({
  height: 26,
  paint(at) {
    const { truth, seen } = at.episode;
    shadeBlank(at);
    heading(at, input.name, input.unit);
    const low = seen ? Math.min(truth.low[k], seen.low[k]) : truth.low[k];
    const high = seen ? Math.max(truth.high[k], seen.high[k]) : truth.high[k];
    curve(at, (step) => truth.at(step, k), low, high, seen ? shadeOf('--faint') : COLOURS[0]);
    if (seen) curve(at, (step) => seen.at(step, k), low, high, COLOURS[0]);
  },
  value(episode, step) {
    if (episode.blank[step]) return 'blank';
    return short((episode.seen || episode.truth).at(step, k));
  },
}));

const actionRows = () => DATA.outputs.map((output, k) => ({
  height: DATA.choices ? 30 : 26,
  paint(at) {
    heading(at, output.name, output.unit);
    const { action } = at.episode;
    const [low, high] = DATA.choices ? [0, DATA.choices - 1] : [action.low[k], action.high[k]];
    curve(at, (step) => action.at(step, k), low, high, COLOURS[1]);
  },
  value: (episode, step) => (DATA.choices ? String(Math.round(episode.action.at(step, k))) : short(episode.action.at(step, k))),
}));

const rewardRows = () => [
  {
    height: 30,
    paint(at) {
      heading(at, 'reward of the step');
      curve(at, (step) => at.episode.reward.at(step, 0), at.episode.reward.low[0], at.episode.reward.high[0], COLOURS[2]);
    },
    value: (episode, step) => short(episode.reward.at(step, 0)),
  },
  {
    height: 30,
    paint(at) {
      heading(at, 'return so far');
      const { returns } = at.episode;
      let [low, high] = [0, 0];
      for (const value of returns) { low = Math.min(low, value); high = Math.max(high, value); }
      curve(at, (step) => returns[step], low, high, COLOURS[2]);
    },
    value: (episode, step) => short(episode.returns[step]),
  },
];

const nameOf = (program) => (program < 0 ? 'another' : 'p' + DATA.programs[program].id);

const actedRows = (actors) => Array.from({ length: actors }, (_, output) => ({
  height: 18,
  paint(at) {
    const { pen, episode, span, top, height, x } = at;
    heading(at, actors > 1 ? DATA.outputs[output].name : 'program');
    for (let step = span.from; step < span.to; ) {
      const program = actor(episode, step, output);
      let end = step + 1;
      while (end < span.to && actor(episode, end, output) === program) end++;
      pen.fillStyle = colourOf(program);
      pen.fillRect(x(step), top + 2, Math.max(x(end) - x(step), 0.6), height - 5);
      step = end;
    }
  },
  value: (episode, step) => nameOf(actor(episode, step, output)),
}));

const bidRows = () => [{
  height: DATA.programs.length > 1 ? 170 : 40,
  paint(at) {
    const { bids } = at.episode;
    heading(at, DATA.wide ? 'powers of ten' : 'bid');
    if (!DATA.programs.length) return;
    const [low, high] = [Math.min(...bids.low), Math.max(...bids.high)];
    // Those that act most often lie on top.
    for (let k = bids.channels - 1; k >= 0; k--) curve(at, (step) => bids.at(step, k), low, high, colourOf(k));
    at.pen.fillStyle = shadeOf('--faint');
    const text = (v) => short(DATA.wide ? Math.sinh(v) : v);
    if (low === high) return;
    at.pen.fillText(text(high), LABEL - 52, at.top + 8, 48);
    at.pen.fillText(text(low), LABEL - 52, at.top + at.height - 9, 48);
  },
  value(episode, step) {
    const program = actor(episode, step, 0);
    if (program < 0) return '';
    const bid = episode.bids.at(step, program);
    return short(DATA.wide ? Math.sinh(bid) : bid);
  },
}];
