// Curves of a page: uPlot draws them, the arrow keys move one cursor through all.
function charts(data) {
  const INK = "#333333", SOFT = "#595959", GRID = "#e4e4e4", AXIS = 54;
  const shown = data.tracks.map(() => true), plots = [];
  const whole = [data.time[0], data.time[data.time.length - 1]];
  let range = whole.slice(), at = null;

  const colour = (line) => (line.track === null ? "#8a4f9e" : data.tracks[line.track].colour);
  const dashed = (line) => (line.dash || (line.track !== null && data.tracks[line.track].dash) ? [6, 4] : []);
  const visible = (line) => line.track === null || shown[line.track];

  function behind(u, chart) { // where a foot stands, limits, zero
    const c = u.ctx, box = u.bbox, x = (t) => u.valToPos(t, "x", true), y = (v) => u.valToPos(v, "y", true);
    c.save(); c.beginPath(); c.rect(box.left, box.top, box.width, box.height); c.clip();
    c.fillStyle = "#f1f1f1";
    chart.stands.forEach(([a, b]) => c.fillRect(x(a), box.top, x(b) - x(a), box.height));
    c.strokeStyle = "#8c8c8c"; c.lineWidth = devicePixelRatio; c.setLineDash([4 * devicePixelRatio, 3 * devicePixelRatio]);
    chart.levels.concat(chart.small ? [0] : []).forEach((v) => {
      c.beginPath(); c.moveTo(box.left, y(v)); c.lineTo(box.left + box.width, y(v)); c.stroke();
    });
    c.restore();
  }

  function before(u, chart) { // touchdowns, and the bars of valves
    const c = u.ctx, box = u.bbox, x = (t) => u.valToPos(t, "x", true), dpr = devicePixelRatio;
    c.save(); c.beginPath(); c.rect(box.left, box.top, box.width, box.height); c.clip();
    chart.rows.forEach((row, i) => row.lanes.forEach(([track, spans], k) => {
      if (!shown[track]) return;
      const high = box.height / chart.rows.length, lane = 0.8 * high / row.lanes.length;
      const top = box.top + i * high + 0.1 * high + k * lane;
      c.fillStyle = data.tracks[track].colour;
      spans.forEach(([a, b]) => c.fillRect(x(a), top, Math.max(dpr, x(b) - x(a)), Math.max(dpr, lane - dpr)));
    }));
    data.marks.forEach(([t, track]) => {
      if (!shown[track]) return;
      c.strokeStyle = data.tracks[track].colour; c.lineWidth = dpr; c.setLineDash([2 * dpr, 2 * dpr]);
      c.beginPath(); c.moveTo(x(t), box.top); c.lineTo(x(t), box.top + box.height); c.stroke();
    });
    c.restore();
    if (!chart.small) return;
    c.fillStyle = SOFT; c.font = `${11 * dpr}px system-ui, sans-serif`; c.textBaseline = "bottom"; c.textAlign = "left";
    c.fillText(`error [${chart.unit}]`, box.left, box.top - 2 * dpr);
  }

  function reach(chart, low, high) { // of the y axis: at least `least` wide
    if (!isFinite(low) || !isFinite(high)) return [0, 1];
    const middle = (low + high) / 2, half = Math.max((high - low) / 2, chart.least / 2, 1e-9) * 1.06;
    return [middle - half, middle + half];
  }

  function build(box) {
    const chart = data.charts[+box.dataset.chart], bars = chart.rows.length > 0;
    const lines = chart.lines, table = [data.time].concat(lines.map((line) => line.v));
    const series = [{}].concat(lines.map((line) => ({
      stroke: colour(line), width: 1.6, dash: dashed(line), show: visible(line), spanGaps: false, points: { show: false },
    })));
    const bands = [];
    if (chart.band) {
      chart.band.forEach((end) => { table.push(end); series.push({ stroke: "#8a4f9e55", width: 0.5, points: { show: false } }); });
      bands.push({ series: [table.length - 1, table.length - 2], fill: "#8a4f9e33" });
    }
    if (bars) { table.push(data.time.map(() => null)); series.push({}); }
    const font = "12px system-ui, sans-serif", last = box === box.parentElement.lastElementChild;
    const axis = { stroke: SOFT, font, grid: { stroke: GRID, width: 1 }, ticks: { stroke: GRID, size: 4 } };
    const names = (u) => chart.rows.map((row, i) => chart.rows.length - i - 0.5);
    const plot = new uPlot({
      padding: [chart.small ? 15 : null, null, null, null],
      width: box.clientWidth, height: box.clientHeight, legend: { show: false },
      cursor: { y: false, drag: { x: true, y: false, setScale: false }, sync: { key: "page" }, points: { size: 5 } },
      scales: {
        x: { time: false, range: () => range },
        y: { range: (u, low, high) => (bars ? [0, chart.rows.length] : reach(chart, low, high)) },
      },
      axes: [
        { ...axis, size: last ? 34 : 8, values: (u, ticks) => ticks.map((t, i) => (last ? +t.toFixed(4) + (i === ticks.length - 1 ? " s" : "") : "")) },
        { ...axis, size: AXIS, space: chart.small ? 12 : 26,
          splits: bars ? names : undefined,
          values: (u, ticks) => (bars ? chart.rows.map((row) => row.label) : ticks.map((t) => `${+t.toPrecision(6)}`)) },
      ],
      series, bands,
      hooks: {
        drawClear: [(u) => behind(u, chart)], draw: [(u) => before(u, chart)],
        setCursor: [(u) => { if (u.cursor.idx !== null && u.cursor.idx !== at && u.cursor.left >= 0) tell(u.cursor.idx); }],
        setSelect: [(u) => { if (u.select.width > 4) zoom([u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x")]); }],
      },
    }, table, box);
    plots.push({ plot, box, chart });
    plot.over.addEventListener("dblclick", () => zoom(whole.slice()));
    box.addEventListener("keydown", (e) => key(e, plot));
  }

  function zoom(to) {
    range = to;
    plots.forEach(({ plot }) => { plot.setSelect({ width: 0, height: 0 }, false); plot.setScale("x", { min: to[0], max: to[1] }); });
  }

  function tell(index) { // the numbers under the cursor, above each figure
    at = index;
    plots.forEach(({ box, chart }) => {
      if (box !== box.parentElement.querySelector(".chart")) return;
      const said = chart.lines.filter(visible).filter((line) => line.v[index] !== null);
      box.parentElement.querySelector("output").innerHTML = said.map((line) =>
        `<i style="background:${colour(line)}"></i>${+line.v[index].toPrecision(4)}`).join("");
      box.parentElement.querySelector("output").title = said.map((line) => line.label).join(", ");
    });
    const clock = document.querySelector(".key output");
    if (clock) clock.textContent = `${data.time[index].toFixed(3)} s`;
    document.dispatchEvent(new CustomEvent("moment", { detail: data.time[index] }));
  }

  function move(index, plot) {
    const t = data.time[Math.min(data.time.length - 1, Math.max(0, index))];
    plot.setCursor({ left: plot.valToPos(t, "x"), top: 10 });
  }

  function key(e, plot) {
    const far = e.shiftKey ? 50 : 5, from = at === null ? 0 : at;
    const to = { ArrowRight: from + far, ArrowLeft: from - far, Home: 0, End: data.time.length - 1 }[e.key];
    if (e.key === "Escape") zoom(whole.slice());
    else if (to === undefined) return;
    else move(to, plot);
    e.preventDefault();
  }

  function toggle(button) {
    const i = +button.dataset.track;
    shown[i] = !shown[i];
    document.querySelectorAll(`[data-track="${i}"]`).forEach((b) => b.setAttribute("aria-pressed", shown[i]));
    plots.forEach(({ plot, chart }) => {
      chart.lines.forEach((line, k) => { if (line.track === i) plot.setSeries(k + 1, { show: shown[i] }); });
      plot.redraw(false);
    });
  }

  function fit() { plots.forEach(({ plot, box }) => plot.setSize({ width: box.clientWidth, height: box.clientHeight })); }

  document.querySelectorAll(".chart").forEach(build);
  document.querySelectorAll("button[data-track]").forEach((b) => { b.onclick = () => toggle(b); });
  window.addEventListener("resize", fit);
  const paper = window.matchMedia("print");
  paper.addEventListener("change", fit);
  window.addEventListener("beforeprint", fit); window.addEventListener("afterprint", fit);
  document.documentElement.dataset.charts = plots.length;
}
