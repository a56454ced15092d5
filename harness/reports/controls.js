// The controls of the player: buttons, lists, keys and addresses.

function control(root) {
  const part = name => root.querySelector(`[data-is="${name}"]`);
  const button = name => root.querySelector(`[data-do="${name}"]`);
  const [arms, beside, slider, clock, speed, status] = ["arm", "with", "time", "time-text", "speed", "status"].map(part);
  const [worst] = games.keys();
  const player = new Player(root.querySelector(".screens"), show);
  const list = new GamesList(root, key => to(key));

  function show() {
    const { time, duration, playing } = player;
    slider.max = duration;
    slider.step = player.game?.step ?? "any";
    slider.value = time;
    slider.setAttribute("aria-valuetext", `${time.toFixed(1)} of ${duration.toFixed(1)} seconds`);
    clock.textContent = `${time.toFixed(2)} / ${duration.toFixed(1)} s`;
    root.dataset.time = time;
    button("play").textContent = playing ? "Pause" : "Play";
    button("play").setAttribute("aria-pressed", playing);
    button("road").hidden = !player.beside;
    button("road").textContent = player.oneRoad ? "Two roads" : "One road";
    button("reference").hidden = !player.screens.some(screen => screen.game.reference);
    button("reference").setAttribute("aria-pressed", player.reference);
    button("view").textContent = player.follows ? "Follow" : "Whole road";
    button("view").setAttribute("aria-pressed", player.follows);
  }

  function report(text) {
    status.textContent = text;
  }

  /** Write the address of this moment to the address bar, so that reloading returns to it. */
  function remember() {
    if (player.game) history.replaceState(null, "", player.address());
  }

  async function open(key, other, time) {
    if (!await player.open(key, other, time)) return false;
    root.dataset.game = key;
    if (list.arm !== null && list.arm !== player.game.arm) arms.value = player.game.arm;
    list.ofArm(arms.value || null);
    list.show(key);
    offer(player.game);
    beside.value = player.beside ? keyOf(player.beside) : "";
    root.dataset.ready ??= Math.round(performance.now()); // milliseconds since the page was requested
    report("");
    return true;
  }

  /** The same episode in the other arms, the counterpart first. */
  function offer(game) {
    const same = [...games.values()].filter(each => each !== game && each.episode === game.episode && each.seed === game.seed);
    const first = counterpartOf(game);
    same.sort((a, b) => (b === first) - (a === first));
    const options = same.map(each => make("option", { value: keyOf(each), text: `${each.arm}: ${OUTCOMES[each.outcome] ?? each.outcome}` }));
    beside.replaceChildren(make("option", { value: "", text: "nothing" }), ...options);
  }

  function fillArms() {
    const counts = new Map();
    for (const game of games.values()) counts.set(game.arm, (counts.get(game.arm) ?? 0) + 1);
    arms.append(make("option", { value: "", text: `every arm (${games.size})` }));
    arms.append(...[...counts].map(([arm, count]) => make("option", { value: arm, text: `${arm} (${count})` })));
    const wanted = parsed(location.hash)?.key;
    arms.value = games.get(games.has(wanted) ? wanted : worst).arm;
    list.arm = arms.value;
  }

  async function copyLink() {
    remember();
    try {
      await navigator.clipboard.writeText(location.href);
      report("The link to this moment is copied.");
    } catch {
      report("The link to this moment is in the address bar.");
    }
  }

  const to = key => key && open(key).then(remember);
  const faster = by => {
    speed.selectedIndex = Math.min(Math.max(speed.selectedIndex + by, 0), speed.options.length - 1);
    player.speed = Number(speed.value);
  };
  const nextTouch = () => {
    const times = player.screens.flatMap(screen => screen.game.touches.map(touch => touch.time)).sort((a, b) => a - b);
    if (times.length) player.seek(times.find(time => time > player.time + 1e-6) ?? times[0]);
  };
  const actions = {
    play: () => { player.playing ? player.pause() : player.play(); if (!player.playing) remember(); },
    start: () => { player.pause(); player.seek(0); },
    end: () => { player.pause(); player.seek(player.duration); },
    back: () => player.step(-1),
    on: () => player.step(1),
    secondBack: () => player.seek(player.time - 1),
    secondOn: () => player.seek(player.time + 1),
    faster: () => faster(1),
    slower: () => faster(-1),
    view: () => player.look(!player.follows),
    in: () => player.zoom(1.25),
    out: () => player.zoom(0.8),
    resetView: () => player.eachCamera(camera => camera.reset()),
    later: () => to(list.beside(1)),
    earlier: () => to(list.beside(-1)),
    beside: () => {
      const other = player.beside ? undefined : counterpartOf(player.game);
      if (!other && !player.beside) report("This page does not contain this episode of the other ego.");
      else open(root.dataset.game, other && keyOf(other), player.time).then(remember);
    },
    contact: nextTouch,
    road: () => {
      player.oneRoad = !player.oneRoad;
      player.arrange();
      player.seek(player.time);
      remember();
    },
    reference: () => {
      player.reference = !player.reference;
      player.seek(player.time);
    },
    link: copyLink,
  };
  const keys = {
    " ": "play", ",": "back", ".": "on", Home: "start", End: "end", ArrowLeft: "secondBack", ArrowRight: "secondOn",
    ArrowUp: "faster", ArrowDown: "slower", "+": "in", "=": "in", "-": "out", 0: "resetView", f: "view", n: "later",
    p: "earlier", b: "beside", c: "contact", g: "road", l: "link", r: "reference",
  };

  for (const each of root.querySelectorAll("[data-do]")) each.addEventListener("click", () => actions[each.dataset.do]());
  root.addEventListener("keydown", event => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.target.matches("select, summary")) return;
    if (event.key === " " && event.target.matches("button")) return; // the browser presses the button
    const action = actions[keys[event.key]];
    if (!action) return;
    event.preventDefault();
    action();
  });
  slider.addEventListener("input", () => {
    const wanted = Number(slider.value); // before pausing, which resets the slider
    player.pause();
    player.seek(wanted);
  });
  slider.addEventListener("change", remember);
  speed.addEventListener("change", () => { player.speed = Number(speed.value); });
  arms.addEventListener("change", () => {
    list.ofArm(arms.value || null);
    to(list.order()[0]);
  });
  beside.addEventListener("change", () => open(root.dataset.game, beside.value, player.time).then(remember));

  /** Open the game of the address; `moved`: a link to it was just followed. */
  async function follow(moved) {
    const wanted = parsed(location.hash);
    if (!wanted && moved) return;
    if (wanted?.beside) player.oneRoad = wanted.oneRoad;
    const found = wanted && await open(wanted.key, wanted.beside, wanted.time);
    if (!found && !player.game) await open(worst);
    if (!wanted) return;
    if (!found) report("This page does not contain that game. It is in the run folder: harness replay opens it.");
    root.scrollIntoView({ behavior: moved && !stillMotion.matches ? "smooth" : "auto" });
    root.focus({ preventScroll: true });
    if (found && moved && wanted.time === undefined && !stillMotion.matches) {
      player.seek(0);
      player.play();
    }
  }

  fillArms();
  root.hidden = false;
  window.addEventListener("hashchange", () => follow(true));
  follow(false).then(() => setTimeout(() => list.fill()));
}

const playerElement = document.querySelector(".player");
if (playerElement) control(playerElement);
