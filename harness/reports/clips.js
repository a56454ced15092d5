// The cards' small animations: the worst game of a persona, repeated while it is visible.

const HOLD_S = 1.6;

async function clip(figure) {
  const game = games.get(normal(figure.dataset.game));
  if (!game) return;
  await opened(game);
  const [canvas, button] = [figure.querySelector("canvas"), figure.querySelector("button")];
  const camera = new Camera(44);
  let [time, playing, seen, before] = [momentOf(game), false, false, null];
  const sheet = new Sheet(canvas, draw);

  function draw() {
    const { context, ratio, width, height } = sheet;
    const shown = Math.min(time, game.duration);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    camera.look([game], shown, width, height);
    drawRoad(context, camera, ratio);
    drawGame(context, camera, ratio, game, shown);
    const [halfX, halfY] = [button.offsetWidth / 2, button.offsetHeight / 2];
    const covered = { x: button.offsetLeft + halfX, y: button.offsetTop + halfY, halfX, halfY };
    drawNames(context, camera, playerNames(camera, game, shown), [covered]);
    figure.dataset.time = time.toFixed(3);
  }

  function go(now) {
    if (!playing || !seen) {
      before = null;
      return;
    }
    if (before !== null) time += Math.min(now - before, 250) / 1000;
    if (time > momentOf(game) + HOLD_S) time = 0;
    before = now;
    draw();
    requestAnimationFrame(go);
  }

  function set(on) {
    playing = on;
    button.textContent = on ? "Pause" : "Play";
    button.setAttribute("aria-pressed", on);
    if (on) requestAnimationFrame(go);
  }

  button.hidden = false;
  button.addEventListener("click", () => set(!playing));
  new IntersectionObserver(entries => {
    const now = entries[entries.length - 1].isIntersecting;
    if (now && !seen && playing) requestAnimationFrame(go);
    seen = now;
  }).observe(canvas);
  stillMotion.addEventListener("change", () => set(!stillMotion.matches));
  draw();
  if (!stillMotion.matches) {
    time = 0;
    set(true);
  } else {
    set(false);
  }
}

for (const figure of document.querySelectorAll(".clip")) clip(figure);
