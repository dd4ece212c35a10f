// The page: what DATA says, in its order.

const $ = (id) => document.getElementById(id);
const add = (parent, tag, text, name) => {
  const element = parent.appendChild(document.createElement(tag));
  if (text !== undefined) element.textContent = text;
  if (name) element.className = name;
  return element;
};

$('title').textContent = document.title = DATA.title;
for (const [name, value] of DATA.facts) {
  const fact = add($('facts'), 'span', name + ' ');
  add(fact, 'b', value);
}
for (const { label, path } of DATA.links) add($('links'), 'a', label).href = path.split('/').map(encodeURIComponent).join('/');

function addTable(parent, { title, head, rows }) {
  add(parent, 'h2', title);
  const table = add(add(parent, 'div', undefined, 'scroll'), 'table');
  const top = add(table, 'tr');
  for (const name of head) add(top, 'th', name);
  for (const row of rows) {
    const line = add(table, 'tr');
    for (const text of row) add(line, 'td', text);
  }
}
for (const table of DATA.tables) addTable($('tables'), table);

if (DATA.settings.length) {
  const other = DATA.settings.filter((setting) => setting.default !== undefined);
  add($('settings'), 'h2', `settings that differ from the defaults (${other.length} of ${DATA.settings.length})`);
  const show = (parent, settings, head) => {
    const table = add(parent, 'table');
    const top = add(table, 'tr');
    for (const name of head) add(top, 'th', name);
    for (const { key, value, default: usual } of settings) {
      const line = add(table, 'tr', undefined, usual === undefined ? '' : 'other');
      for (const text of [key, value, usual ?? ''].slice(0, head.length)) add(line, 'td', text);
    }
  };
  show($('settings'), other, ['key', 'value', 'default']);
  const rest = add($('settings'), 'details');
  add(rest, 'summary', 'all settings');
  show(rest, DATA.settings, ['key', 'value']);
}

if (!DATA.charts.length) $('over').hidden = true;
const charts = DATA.charts.map((chart) => {
  const figure = add($('charts'), 'figure');
  const caption = add(figure, 'figcaption', chart.title + ' ');
  if (chart.note) add(caption, 'span', chart.note, 'faint').style.fontWeight = 'normal';
  const canvas = add(figure, 'canvas');
  const legend = add(figure, 'div', undefined, 'legend number');
  const hidden = new Set();
  let [drawn, mark] = [null, null];
  const labels = chart.series.map((series, k) => {
    const button = add(legend, 'button');
    const dash = add(button, 'i');
    dash.style.background = COLOURS[k % COLOURS.length];
    button.append(series.label);
    button.onclick = () => { hidden.has(k) ? hidden.delete(k) : hidden.add(k); button.classList.toggle('off'); draw(); };
    return add(button, 'span');
  });
  function draw() {
    drawn = drawChart(canvas, chart, $('axis').value, hidden, mark);
    drawn.curves.forEach(({ points }, k) => {
      let point = points[points.length - 1];
      if (mark !== null) point = points.findLast((one) => one.x <= mark) ?? points[0];
      labels[k].textContent = point ? ' ' + short(point.y) + (point.low === undefined ? '' : ` [${short(point.low)}, ${short(point.high)}]`) : '';
    });
  }
  canvas.onmousemove = (event) => { mark = drawn.at(event.offsetX); draw(); };
  canvas.onmouseleave = () => { mark = null; draw(); };
  return { draw, canvas, chart, drawn: () => drawn };
});

function drawAll() {
  for (const chart of charts) chart.draw();
}

// What is shown, for scripts.
function tell() {
  const inked = (canvas) => {
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let i = 3; i < data.length; i += 4) if (data[i]) count++;
    return count;
  };
  $('state').textContent = JSON.stringify({
    axis: $('axis').value,
    charts: charts.map(({ canvas, chart, drawn }) => ({
      title: chart.title,
      inked: inked(canvas),
      series: drawn().curves.map(({ series, points }) => ({ label: series.label, points: points.length, first: points[0] ?? null, last: points[points.length - 1] ?? null })),
    })),
  });
}

// An address may choose the axis: #axis=minutes
const wanted = new URLSearchParams(location.hash.slice(1)).get('axis');
if (['steps', 'generations', 'minutes'].includes(wanted)) $('axis').value = wanted;
$('axis').onchange = () => { drawAll(); tell(); };
addEventListener('resize', drawAll);
drawAll();
tell();
