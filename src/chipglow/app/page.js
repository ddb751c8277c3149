// The page of the app around its figures. Its content comes from Python in messages of a kind and a
// content; what the user does goes back in messages.

const BORDER = 54, GAP = 18, LEAST_FRAME = 180;
const NARROW = 888, LEAST_PAIR = 560; // widths in pixels of the part beside the controls
const LEAST_IN_ROW = 150; // width of a frame up to which all images stand in one row
const ACROSS = 3; // images in a row if they do not
const GRIP = 12; // pixels

export function render({ view, model, el }) {
  const page = document.createElement("div");
  page.className = "app";
  page.innerHTML = model.html;
  const spec = JSON.parse(page.querySelector("main").dataset.spec), extent = spec.extent;
  const find = (selector) => page.querySelector(selector);
  const each = (selector, kind, act) => {
    for (const one of page.querySelectorAll(selector)) one.addEventListener(kind, () => act(one));
  };
  const named = (name) => view.model.document.get_model_by_name(name);
  const plotOf = (name) => Bokeh.index.find_one_by_id(named(`${name}_figure`).id);
  const figures = model.get_child("figures");
  spec.figures.forEach((name, i) => find(`#figure-${name}`).prepend(figures[i]));
  const dropper = model.get_child("dropper");
  if (dropper) find(".dropper").append(dropper);
  find(".hint").before(model.get_child("tools"));
  find(".panels").append(...model.get_child("panels"));
  el.style.width = "100%";
  el.append(page);

  // Messages to Python. A moving control sends once per frame of the screen at most.

  let sent = 0, waiting = null;
  function send(kind, content = null) {
    sent += 1;
    model.send_msg({ n: sent, kind, content });
    return sent;
  }
  function change(path, text, final) {
    const entry = controls.get(path), texts = { [path]: text };
    const asked = waiting !== null;
    waiting = final ? null : texts;
    entry.sent = final ? send("change", { texts, final }) : Infinity;
    if (final || asked) return;
    requestAnimationFrame(() => {
      if (waiting === null) return;
      const n = send("change", { texts: waiting, final });
      for (const one of Object.keys(waiting)) controls.get(one).sent = n;
      waiting = null;
    });
  }

  const afterPaint = (act) => requestAnimationFrame(() => setTimeout(act, 0));

  each("[data-send]", "click", ({ dataset }) => send(dataset.send, dataset.content ?? ""));

  // Controls: those of the column, and the positions of the cursor and of the ends of the lines.

  const controls = new Map();
  for (const box of page.querySelectorAll("[data-path]")) {
    const path = box.dataset.path, stops = spec.stops[path] ?? [];
    const field = box.querySelector("select, input[type=text]"), slider = box.querySelector("input[type=range]");
    const entry = { box, field, slider, stops, sent: 0, text: "", typing: false };
    controls.set(path, entry);
    // A text that is being typed stays, whatever comes from Python meanwhile.
    field.addEventListener("input", () => { entry.typing = field.type === "text"; });
    field.addEventListener("change", () => {
      entry.typing = false;
      change(path, field.value, true);
    });
    field.addEventListener("blur", () => {
      if (entry.typing) field.value = entry.text;
      entry.typing = false;
    });
    for (const kind of slider ? ["input", "change"] : []) {
      slider.addEventListener(kind, () => {
        const at = Number(slider.value);
        setText(entry, entry.stops.length ? entry.stops[at] : Number(at.toPrecision(9)));
        change(path, field.value, kind === "change");
      });
    }
  }
  function setText({ field, slider, box }, text) {
    field.value = text;
    const unit = box.querySelector(".unit").textContent;
    slider.setAttribute("aria-valuetext", text === "" ? "none" : `${text} ${unit}`);
  }

  // The player goes on when the page has painted the picture before.
  let playing = false, stepped = 0;
  function step(by) {
    const { slider, stops } = controls.get("start");
    slider.value = (Number(slider.value) + by + stops.length) % stops.length;
    stepped = performance.now();
    slider.dispatchEvent(new Event(playing ? "input" : "change"));
  }
  each("[data-step]", "click", ({ dataset }) => step(Number(dataset.step)));
  each("#play", "click", (play) => {
    playing = !playing;
    play.textContent = playing ? "Pause" : "Play";
    if (playing) step(1);
  });

  // Places on the images: the cursor, the lines and the view are dragged; a click sets the cursor.

  const points = (name) => controls.get(name).text.split(";").map((one) => one.split(",").map(Number));
  const drawn = { rake_line: [], band_line: [], cursor: [] };
  const axes = (places) => [0, 1].map((axis) => places.map((one) => one[axis]));
  function draw(name, columns) {
    const source = named(name);
    source?.setv({ data: { ...source.data, ...columns } }, { sync: false });
  }
  function setPlaces(name, places) {
    if (String(drawn[name]) === String(places)) return; // each change paints all images again
    drawn[name] = places;
    if (name === "cursor") {
      const [x, y] = axes([...places, ...places]); // each with a halo
      return draw("cursor", { x, y });
    }
    const lines = [drawn.rake_line, drawn.band_line];
    if (lines.some((line) => line.length === 0)) return; // the other one follows
    const [xs, ys] = axes([...lines, ...lines].map(axes)), [x, y] = axes(lines.flat());
    draw("lines", { xs, ys });
    draw("ends", { x, y });
  }
  function clamped(x, y) {
    return [Math.min(Math.max(x, extent[0]), extent[1]), Math.min(Math.max(y, extent[2]), extent[3])];
  }

  function grip(down) {
    const cell = down.target.closest?.(".figure");
    if (!cell || down.button !== 0) return;
    const plot = plotOf(cell.id.replace("figure-", "")), figure = plot.model;
    // A tool that draws or edits, once chosen, has the pointer for itself.
    if (figure.toolbar.tools.some((one) => one.active && /Draw|Edit|Select/.test(one.type))) return;
    const box = plot.canvas_view.el.getBoundingClientRect();
    const { x_scale, y_scale, bbox } = plot.frame;
    const at = (event) => [x_scale.invert(event.clientX - box.x), y_scale.invert(event.clientY - box.y)];
    if (!bbox.contains(down.clientX - box.x, down.clientY - box.y)) return;
    const { x_range, y_range } = figure;
    const pixel = (x_range.end - x_range.start) / figure.inner_width;
    const start = at(down), ends = [x_range.start, x_range.end, y_range.start, y_range.end];
    const near = ([x, y]) => Math.hypot(x - start[0], y - start[1]) < GRIP * pixel;
    let held = null;
    for (const name of ["rake_line", "band_line", "cursor"]) {
      const places = points(name);
      const index = places.findIndex(near);
      if (!held && index >= 0) held = { name, places, moved: [index] };
    }
    for (const name of held ? [] : ["rake_line", "band_line"]) {
      const places = points(name), [[x0, y0], [x1, y1]] = places;
      const [dx, dy] = [x1 - x0, y1 - y0];
      const along = ((start[0] - x0) * dx + (start[1] - y0) * dy) / (dx * dx + dy * dy);
      const t = Math.min(Math.max(along, 0), 1);
      if (near([x0 + t * dx, y0 + t * dy])) held = { name, places, moved: [0, 1] };
    }
    let dragged = false, text = "";
    const move = (event) => {
      const [sx, sy] = [event.clientX - down.clientX, event.clientY - down.clientY];
      dragged ||= Math.hypot(sx, sy) > 3;
      if (!dragged) return;
      if (!held) {
        const [dx, dy] = [-sx * pixel, sy * pixel];
        x_range.setv({ start: ends[0] + dx, end: ends[1] + dx });
        y_range.setv({ start: ends[2] + dy, end: ends[3] + dy });
        return;
      }
      const [x, y] = [start[0] + sx * pixel, start[1] - sy * pixel];
      const places = held.places.map((one, i) => held.moved.includes(i)
        ? clamped(...(held.moved.length > 1 ? [one[0] + x - start[0], one[1] + y - start[1]] : [x, y])) : one);
      setPlaces(held.name, places);
      text = places.map((one) => one.map((value) => value.toFixed(1)).join(",")).join(";");
      change(held.name, text, false);
    };
    const up = (event) => {
      for (const [kind, handler] of Object.entries(handlers)) removeEventListener(kind, handler);
      move(event); // of a busy page it may be the first to come
      if (!dragged && event.type === "pointerup") {
        const at = clamped(...start).map((value) => Number(value.toFixed(1)));
        setPlaces("cursor", [at]);
        change("cursor", at.join(","), true);
      } else if (held && text) change(held.name, text, true);
    };
    const handlers = { pointermove: move, pointerup: up, pointercancel: up };
    for (const [kind, handler] of Object.entries(handlers)) addEventListener(kind, handler);
  }

  each("[data-view]", "click", ({ dataset }) => {
    let [left, right, bottom, top] = extent;
    if (dataset.view !== "whole") {
      const places = points(dataset.view);
      const [x, y] = [0, 1].map((axis) => places.reduce((sum, one) => sum + one[axis] / places.length, 0));
      const [half, tall] = [spec.view / 2, spec.view / 2 * spec.shape];
      [left, right, bottom, top] = [x - half, x + half, y - tall, y + tall];
    }
    const { x_range, y_range } = named("measured_figure");
    x_range.setv({ start: left, end: right });
    y_range.setv({ start: bottom, end: top });
  });

  // Messages from Python.

  function showValues({ n, values, ranges, can_undo, can_redo, link }) {
    for (const [path, entry] of controls) {
      const { box, field, slider } = entry, text = values[path];
      if (slider && ranges[path]) {
        if (entry.stops.length) entry.stops = ranges[path];
        [slider.min, slider.max] = entry.stops.length ? [0, entry.stops.length - 1] : ranges[path];
      }
      const stops = entry.stops;
      box.hidden = text === undefined;
      if (box.hidden || entry.sent > n) continue;
      entry.text = text;
      if (!entry.typing) {
        field.removeAttribute("aria-invalid");
        field.value = text;
      }
      if (box.className === "place") setPlaces(path, points(path));
      if (!slider) continue;
      const nearest = (best, one, i) => Math.abs(one - text) < Math.abs(stops[best] - text) ? i : best;
      slider.value = stops.length ? stops.reduce(nearest, 0) : text === "" ? slider.min : text;
      if (!entry.typing) setText(entry, text);
    }
    find("#undo").disabled = !can_undo;
    find("#redo").disabled = !can_redo;
    if (!spec.embedded) {
      const query = new URLSearchParams(link).toString();
      afterPaint(() => history.replaceState(null, "", query ? `?${query}` : location.pathname));
    }
  }

  // Without a number the progress bar says only that something is being done.
  function showStatus({ text, kind, progress, invalid }) {
    find("#status").textContent = text;
    find("#status").className = kind;
    const bar = find("#progress"), draws = typeof progress === "number";
    bar.hidden = progress === undefined;
    draws ? (bar.value = progress) : bar.removeAttribute("value");
    find("#cancel").hidden = !draws;
    if (find("#draw")) find("#draw").disabled = draws;
    for (const path of invalid ?? []) controls.get(path)?.field.setAttribute("aria-invalid", "true");
  }

  // What a tool has drawn is shown until its place is.
  function showPlaces(sources) {
    for (const [name, data] of Object.entries(sources)) named(name)?.setv({ data }, { sync: false });
    if (!sources.outlines) return;
    for (const name of spec.images) {
      for (const one of named(`${name}_figure`).toolbar.tools) if (/Select/.test(one.type)) one.overlay.clear();
    }
  }

  function showNumbers(html) {
    find(".numbers").classList.remove("old");
    find(".numbers").innerHTML = html;
  }

  function saveDownload({ name, url }) {
    Object.assign(document.createElement("a"), { href: url, download: name }).click();
  }

  // Lines of text with the file, the controls and the places, each line as wide as a picture.
  function settingLines(context, width) {
    // The values that Python has, not what is being typed.
    const values = [...controls.values()].filter(({ box }) => !box.hidden).map(({ box, field, text }) => {
      const option = [...field.options ?? []].find((one) => one.value === text);
      const unit = text ? box.querySelector(".unit")?.textContent ?? "" : "";
      const of = box.closest(".figure")?.ariaLabel ?? "", label = box.querySelector("label").textContent;
      return `${of} ${label}: ${option?.text ?? (text || "none")} ${unit}`.trim();
    });
    const lines = [];
    for (const one of [`chipglow ${spec.version}, ${find(".name").textContent}`, ...values]) {
      const longer = lines.length ? `${lines.at(-1)}; ${one}` : one;
      if (lines.length && context.measureText(longer).width <= width) lines[lines.length - 1] = longer;
      else lines.push(one);
    }
    return lines;
  }

  // One picture of all figures as they are, images in a row, lines below, and its settings.
  let quick = true;
  each("#sheet", "click", () => {
    if (quick) return showStatus({ text: "The exact picture is not ready; save again when it is shown.", kind: "error" });
    const lines = spec.figures.filter((one) => !spec.images.includes(one));
    const rows = [shown, lines].map((row) => row.map((one) => plotOf(one).export("png").canvas));
    const sum = (row) => row.reduce((width, one) => width + one.width, 0);
    const tall = rows.map((row) => Math.max(...row.map((one) => one.height)));
    const sheet = document.createElement("canvas"), context = sheet.getContext("2d");
    const width = Math.max(...rows.map(sum)), height = tall[0] + tall[1];
    const pixels = devicePixelRatio, margin = 8 * pixels, spacing = 16 * pixels, font = `${12 * pixels}px sans-serif`;
    context.font = font;
    const settings = settingLines(context, width - 2 * margin);
    Object.assign(sheet, { width, height: height + settings.length * spacing + 2 * margin });
    const { backgroundColor, color } = getComputedStyle(page);
    context.fillStyle = backgroundColor;
    context.fillRect(0, 0, sheet.width, sheet.height);
    rows.forEach((row, i) => row.forEach((one, j) => context.drawImage(one, sum(row.slice(0, j)), i * tall[0])));
    Object.assign(context, { font, fillStyle: color, textBaseline: "top" });
    settings.forEach((line, i) => context.fillText(line, margin, height + margin + i * spacing));
    saveDownload({ name: "chipglow.png", url: sheet.toDataURL() });
    showStatus({ text: "chipglow.png is saved.", kind: "" });
  });

  // A picture counts as painted when the browser had time for it: then come the curves along its
  // lines, and the next picture.
  function showPicture({ number, lines, absent, ...picture }) {
    quick = picture.quick;
    showImages(picture.images);
    find(".numbers").classList.add("old"); // until those of this picture come
    for (const option of controls.get("error_image")?.field.options ?? []) {
      const reason = absent[option.value];
      option.label = option.text + (reason ? `: 0, ${reason}` : "");
      option.disabled = Boolean(reason);
    }
    afterPaint(() => {
      send("painted", number);
      for (const [name, data] of Object.entries(lines)) named(name).setv({ data }, { sync: false });
      const left = 80 - (performance.now() - stepped);
      if (playing) setTimeout(() => playing && step(1), Math.max(left, 0));
    });
  }

  // The images of a mode; the others are hidden.
  let shown = spec.shown;
  function hideOthers() {
    for (const name of spec.images) find(`#figure-${name}`).hidden = !shown.includes(name);
  }
  function showImages(images) {
    if (String(images) === String(shown)) return;
    shown = images;
    hideOthers();
    size = "";
    refit();
  }
  hideOthers();

  // Files, links, theme and size.

  each("#link", "click", async () => {
    const text = location.href;
    const copied = await navigator.clipboard?.writeText(text).then(() => true, () => false);
    find("#status").textContent = copied ? "The link is copied." : text;
  });

  let theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
  function setTheme(name) {
    page.dataset.theme = theme = name;
    if (!spec.embedded) {
      document.documentElement.style.colorScheme = theme;
      document.body.style.background = theme === "dark" ? "#14171c" : "#ffffff";
      document.body.style.margin = "0";
    }
    find("#theme").textContent = theme === "dark" ? "Light" : "Dark";
    send("theme", theme);
    showChip();
  }
  function showChip() {
    if (find(".chip")?.open) send("chip", theme);
  }
  find(".chip")?.addEventListener("toggle", showChip);
  each("#theme", "click", () => setTheme(theme === "dark" ? "light" : "dark"));

  // Figures fit their places, in CSS pixels. All change at once: each change lays the page out.
  let size = "";
  function fit() {
    const width = Math.round(find(".images").getBoundingClientRect().width);
    const height = Math.round(spec.embedded ? 900 : innerHeight);
    if (width < 1 || size === `${width}x${height}`) return false;
    size = `${width}x${height}`;
    const frameOf = (count) => (width - BORDER - (count - 1) * GAP) / count - (count === 1 ? 26 : 12);
    const all = Math.max(shown.length, 2);
    const count = width < LEAST_PAIR ? 1 : frameOf(all) >= LEAST_IN_ROW ? all : Math.min(all, ACROSS);
    const wide = frameOf(count);
    const tallest = Math.max(0.52 * height - 60, LEAST_FRAME);
    const least = Math.min(LEAST_FRAME, wide);
    const frame = Math.trunc(Math.max(Math.min(wide, tallest / spec.shape), least));
    const below = Math.trunc(Math.max(Math.min(height - frame * spec.shape - 372, 330), 150));
    // The first image of a further row stands under that of the first one, which has an axis.
    shown.forEach((name, i) => {
      const starts = i > 0 && i % count === 0 && count > 1;
      find(`#figure-${name}`).style.paddingLeft = starts ? `${BORDER - 4}px` : "";
    });
    // Numbers stand beside the lines, or below them where it is narrow: see page.css.
    const numbers = width > NARROW ? 345 : 60;
    const pair = (width - 2 * BORDER - numbers) / 2 - 20;
    const across = Math.trunc(Math.max(count === 1 ? wide : pair, LEAST_FRAME));
    for (const name of spec.figures) {
      const [frame_width, frame_height] = spec.images.includes(name)
        ? [frame, Math.trunc(frame * spec.shape)] : [across, below];
      named(`${name}_figure`).setv({ frame_width, frame_height }, { sync: false, silent: true });
    }
    return true;
  }
  const refit = () => fit() && view.invalidate_layout();

  // Of a page of its own also the keys that come when nothing has the focus.
  const keyed = spec.embedded ? page : document;
  const onKey = (event) => {
    const typing = event.composedPath()[0].type === "text", key = event.key.toLowerCase();
    if ((event.ctrlKey || event.metaKey) && "zy".includes(key) && !typing) {
      event.preventDefault();
      send("step", key === "y" || event.shiftKey ? "on" : "");
    } else if (key === "enter" && typing) {
      event.preventDefault(); // a notebook would make no change of it
      event.composedPath()[0].dispatchEvent(new Event("change"));
    }
  };
  keyed.addEventListener("keydown", onKey);
  // A notebook takes keys for itself, unless an element over them says otherwise.
  if (spec.embedded) {
    page.addEventListener("focusin", () => {
      for (let one = page; one; one = one.getRootNode().host) one.setAttribute("data-lm-suppress-shortcuts", "true");
    });
  }
  const shows = { values: showValues, status: showStatus, numbers: showNumbers, places: showPlaces, download: saveDownload, picture: showPicture,
    chip: (url) => { find(".chip img").src = url; }, open: (key) => { location.search = `?open=${key}`; },
    ask: (kind) => afterPaint(() => send(kind)) };
  model.on("msg:custom", (messages) => messages.forEach(({ kind, content }) => shows[kind](content)));
  find(".images").addEventListener("pointerdown", grip);
  const watcher = new ResizeObserver(refit);
  model.on("after_render", () => {
    send("ready");
    setTheme(theme);
    refit();
    watcher.observe(find(".images"));
  });
  model.on("remove", () => {
    watcher.disconnect();
    keyed.removeEventListener("keydown", onKey);
  });
  addEventListener("resize", refit);
  fit();
  return page;
}
