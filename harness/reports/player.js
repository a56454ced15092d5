// The player: one clock, and one or two games that follow it.

class Player {
  /** `screens` is the element the games are shown in; `changed` is called whenever the time or the games change. */
  constructor(screens, changed) {
    Object.assign(this, { element: screens, changed, screens: [], time: 0, speed: 1, playing: false, follows: true, oneRoad: false, reference: true });
    this.opening = 0;
  }

  get game() {
    return this.screens[0]?.game;
  }

  get beside() {
    return this.screens[1]?.game;
  }

  /** When the last of the games ends, or what is shown of a reference driver. */
  get duration() {
    return Math.max(0, ...this.screens.map(screen => (this.reference && screen.game.reference || screen.game).duration));
  }

  /** Show a game, or two, at a time; without a time at the last contact or the end. */
  async open(key, beside, time) {
    const turn = ++this.opening;
    if (!games.has(key)) return false;
    const chosen = [games.get(key), games.get(beside)].filter(Boolean);
    await Promise.all(chosen.map(opened));
    if (turn !== this.opening) return true; // another game was requested meanwhile
    this.pause();
    for (const screen of this.screens) screen.close();
    this.screens = chosen.map(game => new GameScreen(game, at => { this.pause(); this.seek(at); }));
    this.element.replaceChildren(...this.screens.map(screen => screen.element));
    this.arrange();
    const strips = stripsOf(chosen);
    for (const screen of this.screens) {
      screen.others = chosen.filter(game => game !== screen.game);
      screen.camera.follows = this.follows;
      screen.start();
      screen.strips.align(strips, this.duration);
    }
    this.seek(time ?? momentOf(chosen[0]));
    return true;
  }

  /** Two games on two roads beside one another, or on one road with the second game as ghosts. */
  arrange() {
    const isPair = this.screens.length > 1;
    this.element.classList.toggle("two", isPair && !this.oneRoad);
    this.element.classList.toggle("one-road", isPair && this.oneRoad);
    for (const screen of this.screens) screen.oneRoad = this.oneRoad;
  }

  seek(time) {
    this.time = Math.min(Math.max(time, 0), this.duration);
    for (const screen of this.screens) {
      screen.reference = this.reference;
      screen.draw(this.time);
    }
    this.changed();
  }

  /** Move by whole steps, from the step that is shown. */
  step(count) {
    this.pause();
    const { step } = this.game;
    this.seek((Math.round(this.time / step) + count) * step);
  }

  play() {
    if (this.playing || !this.game) return;
    if (this.time > this.duration - 1e-6) this.time = 0;
    this.playing = true;
    let before = null;
    const go = now => {
      if (!this.playing) return;
      if (before !== null) this.seek(this.time + Math.min(now - before, 250) / 1000 * this.speed);
      before = now;
      if (this.time >= this.duration) this.pause();
      else requestAnimationFrame(go);
    };
    requestAnimationFrame(go);
    this.changed();
  }

  pause() {
    this.playing = false;
    this.changed();
  }

  /** Show the whole road, or follow the players. */
  look(follows) {
    this.follows = follows;
    this.eachCamera(camera => { camera.follows = follows; camera.reset(); });
  }

  zoom(factor) {
    this.eachCamera(camera => { camera.zoom = Math.min(Math.max(camera.zoom * factor, 0.2), 12); });
  }

  eachCamera(change) {
    for (const screen of this.screens) change(screen.camera);
    this.seek(this.time);
  }

  /** The address of this moment. */
  address() {
    const beside = this.beside ? `&with=${keyOf(this.beside)}` : "";
    return `#game=${keyOf(this.game)}&t=${Number(this.time.toFixed(2))}${beside}${beside && this.oneRoad ? "&road=one" : ""}`;
  }
}

/** The game, time and second game of an address; null without a game. */
function parsed(hash) {
  const parts = new Map(hash.replace(/^#/, "").split("&").map(part => [part.split("=", 1)[0], part.slice(part.indexOf("=") + 1)]));
  if (!parts.has("game")) return null;
  const time = Number.parseFloat(parts.get("t"));
  return {
    key: normal(parts.get("game")),
    beside: parts.has("with") ? normal(parts.get("with")) : undefined,
    time: Number.isFinite(time) ? time : undefined,
    oneRoad: parts.get("road") === "one",
  };
}
