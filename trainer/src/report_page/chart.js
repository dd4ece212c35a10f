// A chart of curves: one run is a line, several of a group are their mean and a band from the least to the greatest.

const COLOURS = ['#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9', '#8c564b', '#7f3fbf', '#6b7a3a', '#2f8f8f'];
const styleOf = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const GRID = 240;

function short(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  const text = size >= 1e9 ? (value / 1e9).toPrecision(3) + ' G' : size >= 1e6 ? (value / 1e6).toPrecision(3) + ' M'
    : size >= 1e4 ? (value / 1e3).toPrecision(3) + ' k' : String(+value.toPrecision(4));
  return text.replace('-', '−');
}

// The points of a series over an axis: x, y, and where there are several runs the least and the greatest y.
function pointsOf(series, axis) {
  const runs = DATA.runs.filter((run) => run.group === series.group && run[axis].length)
    .map((run) => ({ x: run[axis], y: run.columns.find(([name]) => name === series.column)?.[1] || [] }));
  if (runs.length < 2) {
    const [run] = runs;
    return run ? run.x.map((x, k) => ({ x, y: run.y[k] })).filter((point) => point.y !== null && point.y !== undefined) : [];
  }
  // Runs are compared where all of them are; between two of its points a run stands at the earlier one.
  const from = Math.max(...runs.map((run) => run.x[0]));
  const to = Math.min(...runs.map((run) => run.x[run.x.length - 1]));
  if (to < from) return [];
  const places = runs.map(() => 0);
  return Array.from({ length: GRID }, (_, k) => {
    const x = from + ((to - from) * k) / (GRID - 1);
    const values = runs.map((run, r) => {
      while (places[r] + 1 < run.x.length && run.x[places[r] + 1] <= x) places[r]++;
      return run.y[places[r]];
    }).filter((y) => y !== null && y !== undefined);
    if (!values.length) return null;
    return { x, y: values.reduce((sum, y) => sum + y, 0) / values.length, low: Math.min(...values), high: Math.max(...values) };
  }).filter((point) => point);
}

// Round numbers that divide a range into a handful of parts.
function ticks(low, high) {
  const rough = (high - low) / 5 || 1;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
  const marks = [];
  for (let k = Math.ceil(low / step); k * step <= high + step * 1e-9; k++) marks.push(k * step);
  return marks;
}

// Draws a chart into a canvas and returns what it drew. `mark` is a place on the axis that the mouse points to, or null.
function drawChart(canvas, chart, axis, hidden, mark) {
  const ratio = Math.min(devicePixelRatio, 2);
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  const pen = canvas.getContext('2d', { willReadFrequently: true });
  pen.scale(ratio, ratio);
  pen.font = '11px system-ui, sans-serif';
  const curves = chart.series.map((series, k) => ({ series, colour: COLOURS[k % COLOURS.length], points: pointsOf(series, axis), off: hidden.has(k) }));
  const all = curves.filter((curve) => !curve.off).flatMap((curve) => curve.points);
  pen.fillStyle = styleOf('--faint');
  if (!all.length) {
    pen.fillText('nothing yet', width / 2 - 26, height / 2);
    return { curves, at: () => null };
  }
  const range = (values) => [values.reduce((a, b) => Math.min(a, b), Infinity), values.reduce((a, b) => Math.max(a, b), -Infinity)];
  const [left, right] = range(all.map((point) => point.x));
  let [low, high] = range(all.flatMap((point) => (point.low === undefined ? [point.y] : [point.low, point.high])));
  const room = (high - low || Math.abs(high) || 1) * 0.06;
  [low, high] = [low - room, high + room];
  const [x0, x1, y0, y1] = [50, width - 10, height - 20, 6];
  const x = (value) => x0 + ((value - left) / (right - left || 1)) * (x1 - x0);
  const y = (value) => y0 - ((value - low) / (high - low)) * (y0 - y1);
  pen.strokeStyle = styleOf('--line');
  pen.lineWidth = 1;
  pen.textAlign = 'right';
  pen.textBaseline = 'middle';
  for (const tick of ticks(low, high)) {
    pen.beginPath();
    pen.moveTo(x0, y(tick));
    pen.lineTo(x1, y(tick));
    pen.stroke();
    pen.fillText(short(tick), x0 - 6, y(tick));
  }
  pen.textAlign = 'center';
  for (const tick of ticks(left, right)) pen.fillText(short(tick), Math.min(Math.max(x(tick), x0 + 6), x1 - 12), y0 + 12);
  for (const { points, colour, off } of curves) {
    if (off || !points.length) continue;
    if (points[0].low !== undefined) {
      pen.fillStyle = colour + '2a';
      pen.beginPath();
      points.forEach((point) => pen.lineTo(x(point.x), y(point.high)));
      [...points].reverse().forEach((point) => pen.lineTo(x(point.x), y(point.low)));
      pen.fill();
    }
    pen.strokeStyle = pen.fillStyle = colour;
    pen.lineWidth = 1.7;
    pen.beginPath();
    points.forEach((point) => pen.lineTo(x(point.x), y(point.y)));
    pen.stroke();
    if (points.length === 1) pen.fillRect(x(points[0].x) - 2, y(points[0].y) - 2, 4, 4);
  }
  if (mark !== null) {
    pen.strokeStyle = styleOf('--faint');
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(x(mark), y0);
    pen.lineTo(x(mark), y1);
    pen.stroke();
  }
  return { curves, at: (pixel) => left + Math.min(Math.max((pixel - x0) / (x1 - x0), 0), 1) * (right - left) };
}
