// One game on the screen: its title, the road from above, the values, and the curves.

/** An element with attributes, text and children. Text of a document stays text. */
function make(tag, { text, ...attributes } = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  if (text !== undefined) element.textContent = text;
  element.append(...children);
  return element;
}

/** What the ego's perception has lost at a time, and how many ghosts it sees, in words. */
function perceivedIn(game, time) {
  const step = Math.floor(time / game.step + 1e-6);
  const [, lost, ghosts] = (game.perceived ?? []).findLast(each => each[0] <= step) ?? [0, [], 0];
  const names = lost.map(name => {
    const track = game.players.find(each => each.name === name);
    return track ? nameOf(game, track) : name;
  });
  return (names.length ? `, has lost ${names.join(", ")}` : "")
    + (ghosts ? `, sees ${ghosts === 1 ? "a ghost" : `${ghosts} ghosts`}` : "");
}

class GameScreen {
  /** `seek` is called with the time of a click on the curves or on a manoeuvre. */
  constructor(game, seek) {
    this.game = game;
    this.others = []; // games beside this one: the same view, their players as outlines
    this.oneRoad = false; // whether this screen stands for the others too
    this.reference = true; // whether the reference driver that prevents the collision is drawn
    this.camera = new Camera(46);
    this.view = make("canvas", { class: "view", role: "img" });
    this.curves = make("div", { class: "curves", role: "img", "aria-label": this.described() });
    this.values = make("p", { class: "values" });
    this.element = make("article", { class: "screen", "aria-label": titleOf(game) },
      this.heading(), this.view, this.values, this.curves, this.manoeuvres(seek));
    this.time = 0;
    this.seek = seek;
  }

  /** Start drawing; the element must be in the page. */
  start() {
    this.sheet = new Sheet(this.view, () => this.draw(this.time));
    this.strips = new Strips(this.curves, this.game, this.seek);
    let held = null;
    this.view.addEventListener("pointerdown", event => {
      held = [event.clientX, event.clientY];
      this.view.setPointerCapture(event.pointerId);
    });
    this.view.addEventListener("pointermove", event => {
      if (!held || !(event.buttons & 1)) return;
      this.camera.moved.x -= (event.clientX - held[0]) / this.camera.scale;
      this.camera.moved.y += (event.clientY - held[1]) / this.camera.scale;
      held = [event.clientX, event.clientY];
      this.draw(this.time);
    });
    this.view.addEventListener("wheel", event => { // as on maps: zoom with Ctrl or a pinch, else the page scrolls
      if (!event.ctrlKey) return;
      event.preventDefault();
      this.camera.zoom = Math.min(Math.max(this.camera.zoom * Math.exp(-event.deltaY / 200), 0.2), 12);
      this.draw(this.time);
    }, { passive: false });
  }

  heading() {
    const { game } = this;
    const badge = make("span", { class: `badge ${game.outcome === "goal" ? "well" : "failed"}`, text: outcomeOf(game) });
    const title = make("h3", {}, document.createTextNode(`${titleOf(game)} `), badge);
    if (game.reference) {
      const from = (game.reference.players[0].first * game.step).toFixed(1);
      title.append(make("span", { class: "prevented", text: `prevented by the ${game.reference.driver} that takes over at ${from} s` }));
    }
    if (game.cause) title.append(make("span", { class: "cause", text: game.cause }));
    return title;
  }

  described() {
    const ends = this.game.players.map(track => `${nameOf(this.game, track)}: ${OUTCOMES[track.outcome] ?? track.outcome}`);
    return `Speed, acceleration, steering, gap and time to collision over ${this.game.duration.toFixed(1)} s. ${ends.join("; ")}.`;
  }

  /** The manoeuvres as a list of buttons that seek to their times. */
  manoeuvres(seek) {
    const list = make("ol", { class: "marks" });
    for (const mark of this.game.marks) {
      const who = this.game.players.find(track => track.name === mark.player);
      const what = `${mark.from.toFixed(1)} s  ${who ? nameOf(this.game, who) : mark.player}: ${mark.name}`;
      const button = make("button", { type: "button", text: what });
      button.addEventListener("click", () => seek(mark.from));
      list.append(make("li", { class: mark.player === "ego" ? "of-ego" : "of-non-ego" }, button,
        make("span", { text: mark.text ? ` ${mark.text}` : "" })));
    }
    return list;
  }

  draw(time) {
    this.time = time;
    const { sheet, camera, game } = this;
    if (!sheet?.width) return;
    const { context, ratio, width, height } = sheet;
    const shown = Math.min(time, game.duration);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const reference = this.reference && game.reference, ended = time > game.duration + 1e-6;
    if (reference && ended) camera.look([reference], time, width, height);
    else camera.look([game, ...this.others], this.others.length ? time : shown, width, height);
    drawRoad(context, camera, ratio);
    for (const other of this.others) drawGhost(context, camera, ratio, other, time, this.oneRoad);
    if (reference) drawReference(context, camera, ratio, reference, time);
    drawGame(context, camera, ratio, game, shown);
    const texts = [drawScaleBar(context, camera)];
    if (ended) texts.push(this.drawEnded(context, width, reference));
    drawNames(context, camera, this.names(shown, time, reference), texts);
    const [x, y] = camera.place(0, 0);
    this.view.dataset.camera = [x, y, camera.scale].map(value => value.toFixed(4)).join(" ");
    this.strips?.draw(time);
    this.say(shown);
  }

  /** The names of all cars that are drawn with one. */
  names(shown, time, reference) {
    const ghosts = this.oneRoad ? this.others.flatMap(other => ghostNames(this.camera, other, time)) : [];
    const mended = reference ? referenceNames(this.camera, reference, time) : [];
    return [...playerNames(this.camera, this.game, shown), ...mended, ...ghosts];
  }

  /** Say when the game ended. Returns the box of the text. */
  drawEnded(context, width, reference) {
    context.font = `600 ${FONT}`;
    const text = `ended at ${this.game.duration.toFixed(1)} s${reference ? "; the others are taken to go on" : ""}`;
    const halfX = context.measureText(text).width / 2 + LABEL.inset, box = { x: width - 5 - halfX, y: 14, halfX, halfY: LABEL.halfY };
    drawLabel(context, { text, colour: palette.ink, box });
    return box;
  }

  /** The values of the moment as text. */
  say(time) {
    const values = this.game.players.map(track => {
      if (stepAt(this.game, track, time) === null) return [track.name, `${nameOf(this.game, track)}: has left`];
      const speed = `${valueAt(this.game, track, "speed", time).toFixed(1)} m/s`;
      const [gap, soon] = ["gap", "time"].map(name => valueAt(this.game, track, name, time));
      return [track.name, `${nameOf(this.game, track)} ${speed}${track.name === "ego" ? perceivedIn(this.game, time) : ""}`
        + (Number.isNaN(gap) ? "" : `, gap ${gap.toFixed(1)} m`) + (Number.isNaN(soon) ? "" : `, TTC ${soon.toFixed(1)} s`)];
    });
    const text = values.map(each => each[1]).join("; ");
    if (text === this.text) return;
    this.text = text;
    this.values.replaceChildren(...values.map(([name, words]) => make("span", { class: name === "ego" ? "of-ego" : "of-non-ego", text: words })));
    this.view.setAttribute("aria-label", `The road from above at ${time.toFixed(1)} s. ${text}.`);
  }

  close() {
    this.sheet?.close();
    this.strips?.close();
    this.element.remove();
  }
}
