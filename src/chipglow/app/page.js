// The page of the app: what stands around its figures. What it shows comes from Python in messages
// of a kind and a content; what the user does goes back in messages, too.

const FIGURES = ["scene", "measured", "error", "rake_line", "band_line"];
const BORDER = 46, GAP = 18, LEAST_FRAME = 180;
const NARROW = 888; // pixels of the part beside the knobs, which are 292 wide

export function render({ view, model, el }) {
  const spec = JSON.parse(model.spec);
  const page = document.createElement("div");
  page.className = "app";
  el.style.width = "100%";
  const controls = new Map();
  let sent = 0;

  const send = (message) => {
    sent += 1;
    model.send_msg({ n: sent, ...message });
    return sent;
  };

  // A knob that moves sends at most once for each picture of the screen.
  let waiting = null;
  const turn = (name, text, final) => {
    if (final) {
      waiting = null;
      controls.get(name).sent = send({ turn: { [name]: text }, final: true });
      return;
    }
    const first = waiting === null;
    waiting = { [name]: text };
    controls.get(name).sent = Infinity;
    if (first) {
      requestAnimationFrame(() => {
        if (waiting === null) return;
        const turned = waiting;
        waiting = null;
        const n = send({ turn: turned, final: false });
        for (const one of Object.keys(turned)) controls.get(one).sent = n;
      });
    }
  };

  page.append(header(), aside(), main());
  el.append(page);

  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [key, value] of Object.entries(attributes)) {
      if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
      else if (value === true) made.setAttribute(key, "");
      else if (value !== false && value !== null) made.setAttribute(key, value);
    }
    made.append(...children);
    return made;
  }

  function button(text, click, attributes = {}) {
    return element("button", { type: "button", onclick: click, ...attributes }, text);
  }

  function header() {
    const bar = element("header", {});
    bar.append(
      element("h1", {}, "chipglow"),
      element("span", { class: "name", title: spec.name }, spec.name),
    );
    const actions = element("div", { class: "actions", role: "toolbar", "aria-label": "Files and view" });
    if (spec.uploads) {
      const file = element("input", {
        type: "file", accept: ".nc", class: "hidden", "aria-label": "Open a file", tabindex: -1,
        onchange: () => file.files.length && upload(file.files[0]),
      });
      actions.append(file, button("Open…", () => file.click(), { title: "A scene or a measurement, NetCDF" }));
    }
    if (spec.knobs.length > 1) {
      actions.append(
        button("study.yaml", () => send({ save: "study" }), { title: "Save what is set as a study" }),
        button("Figure", () => send({ save: "figure" }), { title: "Save the images and lines as PNG" }),
        button("NetCDF", () => send({ save: "netcdf" }), { title: "Save the measurement and its error" }),
      );
    }
    actions.append(button("Undo", () => send({ undo: true }), { id: "undo", title: "Ctrl+Z" }));
    if (!spec.embedded) {
      actions.append(button("Copy link", copyLink, { title: "A link that restores this state" }));
    }
    actions.append(button("Dark", toggleTheme, { id: "theme" }));
    bar.append(actions);
    return bar;
  }

  function aside() {
    const column = element("aside", { "aria-label": "Knobs" });
    let group = null;
    for (const knob of spec.knobs) {
      if (group?.title !== knob.group) {
        const box = element("fieldset", {}, element("legend", {}, knob.group));
        group = { title: knob.group, box };
        column.append(box);
      }
      group.box.append(control(knob));
      if (knob.name === "start" && knob.stops.length > 1) group.box.append(player(knob));
    }
    return column;
  }

  function control(knob) {
    const id = `knob-${knob.name}`;
    const row = element("div", { class: "knob", "data-knob": knob.name });
    const entry = { knob, row, sent: 0, text: "", typing: false };
    controls.set(knob.name, entry);
    const label = element("label", { for: id }, knob.label);
    if (knob.choices) {
      const options = knob.choices.map(([value, text]) => element("option", { value }, text));
      entry.field = element("select", { id, onchange: () => turn(knob.name, entry.field.value, true) }, ...options);
      row.classList.add("choice");
      row.append(label, entry.field);
      return row;
    }
    entry.field = entryField(entry, { id, inputmode: "decimal", placeholder: knob.optional ? "none" : null });
    row.append(label, element("span", { class: "value" }, entry.field, element("span", { class: "unit" }, knob.unit)));
    const stepped = knob.stops.length > 1;
    if (!knob.stops.length || stepped) {
      const [min, max, step] = stepped ? [0, knob.stops.length - 1, 1] : [knob.low, knob.high, knob.step];
      const text = () => String(stepped ? knob.stops[entry.slider.value] : Number(Number(entry.slider.value).toPrecision(9)));
      const moved = (final) => {
        entry.field.value = text();
        entry.slider.setAttribute("aria-valuetext", `${text()} ${knob.unit}`);
        turn(knob.name, text(), final);
      };
      entry.slider = element("input", {
        type: "range", min, max, step, "aria-label": knob.label,
        oninput: () => moved(false), onchange: () => moved(true),
      });
      row.append(entry.slider);
    }
    return row;
  }

  // What is being typed stays, whatever comes from Python meanwhile.
  function entryField(entry, attributes) {
    return element("input", {
      type: "text", autocomplete: "off", spellcheck: "false", ...attributes,
      oninput: () => { entry.typing = true; },
      onchange: () => {
        entry.typing = false;
        turn(entry.knob.name, entry.field.value, true);
      },
      onblur: () => {
        if (entry.typing) entry.field.value = entry.text;
        entry.typing = false;
      },
    });
  }

  function setControl(entry, text) {
    const { knob, field, slider } = entry;
    entry.text = text;
    if (!entry.typing) {
      field.removeAttribute("aria-invalid");
      field.value = text;
    }
    if (!slider) return;
    let at = Number(text === "" ? knob.low : text);
    if (knob.stops.length > 1) {
      at = knob.stops.reduce((best, one, i) => Math.abs(one - at) < Math.abs(knob.stops[best] - at) ? i : best, 0);
    }
    slider.value = at;
    slider.setAttribute("aria-valuetext", text === "" ? "none" : `${text} ${knob.unit}`);
  }

  // The player steps on when the page has painted the picture before.
  let playing = false;
  let stepped = 0;
  function player(knob) {
    const play = button("Play", () => {
      playing = !playing;
      play.textContent = playing ? "Pause" : "Play";
      if (playing) step(knob, 1);
    }, { id: "play" });
    return element("div", { class: "player" },
      button("◀", () => step(knob, -1), { "aria-label": "One frame back" }), play,
      button("▶", () => step(knob, 1), { "aria-label": "One frame on" }));
  }
  function step(knob, by) {
    const { slider, field } = controls.get(knob.name);
    const count = knob.stops.length;
    slider.value = (Number(slider.value) + by + count) % count;
    stepped = performance.now();
    field.value = knob.stops[slider.value];
    slider.setAttribute("aria-valuetext", `${field.value} ${knob.unit}`);
    turn(knob.name, field.value, !playing);
  }

  function main() {
    const area = element("main", {});
    const zooms = element("div", { class: "zooms", role: "toolbar", "aria-label": "View" });
    for (const [name, text] of spec.views) zooms.append(button(text, () => send({ view: name })));
    zooms.append(place("cursor", "Cursor x, y / µm"));
    zooms.append(element("span", { class: "hint" }, "Drag: cursor, line, view. Wheel: zoom. Grey: out of range."));
    const images = element("div", { class: "images" });
    const below = element("div", { class: "below" });
    for (const name of FIGURES) {
      const child = model.get_child(`${name}_figure`);
      if (!child || !spec.figures.includes(name)) continue;
      const cell = element("div", { class: "figure", id: `figure-${name}`, role: "group", "aria-label": spec.titles[name] }, child);
      if (!name.endsWith("_line")) { images.append(cell); continue; }
      cell.append(place(name, "Ends x, y / µm"));
      below.append(cell);
    }
    below.append(element("section", { class: "numbers", "aria-label": "Numbers at the cursor" }));
    const status = element("div", { class: "status" },
      element("span", { id: "status", role: "status" }),
      element("progress", { id: "progress", max: 1, hidden: true, "aria-label": "Progress" }));
    if (spec.draws) {
      status.append(
        button("Draw phases and textures", () => send({ draw: true }), { id: "draw", title: spec.draws }),
        button("Cancel", () => send({ cancel: true }), { id: "cancel", hidden: true }));
    }
    area.append(zooms, images, below, status);
    return area;
  }

  function place(name, label) {
    const id = `place-${name}`;
    const row = element("span", { class: "place" });
    const entry = { knob: { name, unit: "", stops: [] }, row, sent: 0, text: "", typing: false };
    entry.field = entryField(entry, { id });
    controls.set(name, entry);
    row.append(element("label", { for: id }, label), entry.field);
    return row;
  }

  const find = (selector) => page.querySelector(selector);
  const found = (name) => view.model.document.get_model_by_name(name);

  // What comes from Python.

  function showValues({ n, values, visible, can_undo, link }) {
    for (const [name, text] of Object.entries(values)) {
      const entry = controls.get(name);
      if (entry && entry.sent <= n) setControl(entry, text);
    }
    for (const [name, entry] of controls) {
      if (entry.knob.label) entry.row.hidden = !visible.includes(name);
    }
    find("#undo").disabled = !can_undo;
    if (!spec.embedded) {
      const query = new URLSearchParams(link).toString();
      history.replaceState(null, "", query ? `?${query}` : location.pathname);
    }
  }

  function showStatus({ text, kind, progress, invalid }) {
    find("#status").textContent = text;
    find("#status").className = kind;
    const bar = find("#progress");
    bar.hidden = progress === null;
    if (progress !== null) bar.value = progress;
    if (spec.draws) {
      find("#cancel").hidden = progress === null;
      find("#draw").disabled = progress !== null;
    }
    for (const name of invalid) controls.get(name)?.field.setAttribute("aria-invalid", "true");
  }

  function showNumbers({ rows, parts, note }) {
    const box = find(".numbers");
    const table = element("table", {}, element("caption", {}, "At the cursor"));
    for (const [label, value, tip] of rows) {
      table.append(element("tr", { title: tip ?? "" }, element("th", { scope: "row" }, label), element("td", {}, value)));
    }
    box.classList.remove("old");
    box.replaceChildren(table);
    if (!parts.length) return;
    const most = Math.max(1e-9, ...parts.map((part) => Math.abs(part.kelvin ?? 0)));
    const bars = element("table", { class: "parts" }, element("caption", {}, "Parts of the error"));
    for (const part of parts) {
      const width = 50 * Math.abs(part.kelvin ?? 0) / most;
      const side = part.kelvin < 0 ? `right:50%` : `left:50%`;
      const bar = element("span", { class: `bar ${part.kind}`, style: `width:${width}%;${side}` });
      bars.append(element("tr", { title: part.tip },
        element("th", { scope: "row" }, part.label),
        element("td", { class: "track", "aria-hidden": "true" }, element("span", { class: "axis" }), bar),
        element("td", {}, part.text)));
    }
    box.append(bars, element("p", { class: "note" }, note));
  }

  function saveDownload({ name, type, data }) {
    const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
    const url = URL.createObjectURL(new Blob([bytes], { type }));
    const link = element("a", { href: url, download: name });
    page.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
  }

  // A picture is told to be painted when the browser had the time for it: then comes the next, and
  // meanwhile what stands along the lines of this one.
  function showPicture({ number, lines }) {
    requestAnimationFrame(() => setTimeout(() => {
      send({ painted: number });
      find(".numbers").classList.add("old"); // until those of this picture come
      for (const [name, data] of Object.entries(lines)) {
        found(name).setv({ data }, { sync: false });
      }
      if (!playing) return;
      const left = 80 - (performance.now() - stepped);
      setTimeout(() => playing && step(controls.get("start").knob, 1), Math.max(left, 0));
    }, 0));
  }

  function upload(file) {
    const request = new XMLHttpRequest();
    const say = (text, kind, progress) => showStatus({ text, kind, progress, invalid: [] });
    request.upload.onprogress = (event) => {
      const done = event.loaded === event.total;
      say(`${done ? "Checking" : "Uploading"} ${file.name}`, "busy", event.loaded / event.total);
    };
    request.onload = () => {
      if (request.status === 200) {
        location.search = `?open=${request.responseText}`;
      } else {
        say(request.responseText || `${file.name}: not taken`, "error", null);
      }
    };
    request.onerror = () => say(`${file.name}: the upload broke off, expected a file of up to ${spec.uploads}`, "error", null);
    request.open("POST", `upload?name=${encodeURIComponent(file.name)}`);
    request.send(file);
  }

  async function copyLink() {
    const text = location.origin + location.pathname + location.search;
    try {
      await navigator.clipboard.writeText(text);
      find("#status").textContent = "The link is copied.";
    } catch {
      find("#status").textContent = text;
    }
  }

  // Theme and size.

  let theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
  function setTheme() {
    page.dataset.theme = theme;
    if (!spec.embedded) {
      document.documentElement.style.colorScheme = theme;
      document.body.style.background = theme === "dark" ? "#14171c" : "#ffffff";
      document.body.style.margin = "0";
    }
    find("#theme").textContent = theme === "dark" ? "Light" : "Dark";
    send({ theme });
  }
  function toggleTheme() {
    theme = theme === "dark" ? "light" : "dark";
    setTheme();
  }

  // A notebook takes keys for itself, unless an element over them says otherwise.
  function keepKeys() {
    for (let one = page; one; one = one.getRootNode().host) {
      one.setAttribute("data-lm-suppress-shortcuts", "true");
    }
  }
  if (spec.embedded) page.addEventListener("focusin", keepKeys);

  // Figures fit their places, in CSS pixels. All change at once: every single change would lay the
  // whole page out anew.
  let size = "";
  function fit() {
    const width = Math.round(find("main").getBoundingClientRect().width);
    const height = Math.round(spec.embedded ? 900 : innerHeight);
    if (width < 1 || size === `${width}x${height}`) return false;
    size = `${width}x${height}`;
    const images = spec.figures.filter((name) => !name.endsWith("_line"));
    const count = Math.max(images.length, 2);
    const wide = (width - BORDER - (count - 1) * GAP) / count - 12;
    const tallest = Math.max(0.52 * height - 60, LEAST_FRAME);
    const frame = Math.trunc(Math.max(Math.min(wide, tallest / spec.shape), LEAST_FRAME));
    const below = Math.trunc(Math.max(Math.min(height - frame * spec.shape - 345, 330), 150));
    // Numbers stand beside the lines, or below them where it is narrow: see page.css.
    const numbers = width > NARROW ? 345 : 60;
    const across = Math.trunc(Math.max((width - 2 * BORDER - numbers) / 2 - 20, LEAST_FRAME));
    for (const name of spec.figures) {
      const [frame_width, frame_height] = images.includes(name)
        ? [frame, Math.trunc(frame * spec.shape)] : [across, below];
      found(`${name}_figure`).setv({ frame_width, frame_height }, { sync: false, silent: true });
    }
    return true;
  }
  function refit() {
    if (fit()) view.invalidate_layout();
  }

  page.addEventListener("keydown", (event) => {
    if ((event.ctrlKey || event.metaKey) && event.key === "z" && event.target.type !== "text") {
      event.preventDefault();
      send({ undo: true });
    }
    if (event.key === "Enter" && event.target.type === "text") {
      event.preventDefault(); // in notebooks no change would follow from it
      event.target.dispatchEvent(new Event("change"));
    }
  });
  const shows = { values: showValues, status: showStatus, numbers: showNumbers, download: saveDownload, picture: showPicture };
  model.on("msg:custom", ({ kind, content }) => shows[kind](content));
  const watcher = new ResizeObserver(refit);
  model.on("after_render", () => {
    send({ ready: true });
    setTheme();
    refit();
    watcher.observe(find("main"));
  });
  model.on("remove", () => watcher.disconnect());
  addEventListener("resize", refit);
  fit();
  return page;
}
