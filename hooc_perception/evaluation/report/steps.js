// Sequences of a report: the slider, the play button, the arrow keys and the address of the page
// (#step=7; #s1&step=7 where there are several sequences) say which frame set is shown.
(() => {
'use strict';
const PLAY_MS = 700;

class Player {
  constructor(section) {
    this.section = section;
    this.box = section.querySelector('.space');
    this.slider = section.querySelector('.slider');
    this.button = section.querySelector('.play');
    this.when = section.querySelector('.when');
    this.steps = [...section.querySelectorAll('.step')];
    this.timer = null;
    this.slider.addEventListener('input', () => { this.stop(); this.go(this.number); });
    this.button.addEventListener('click', () => (this.timer ? this.stop() : this.play()));
  }

  get number() { return Number(this.slider.value); }

  // Show the frame set of a number from 1 on.
  show(number) {
    this.slider.value = number;     // the browser keeps it in its range
    const index = this.number - 1;
    this.steps.forEach((step, i) => { step.hidden = i !== index; });
    this.when.textContent = this.steps[index].dataset.when;
    this.box.dataset.step = index;
    if (this.box.view) this.box.view.show(index);
  }

  // Show it, and say so in the address.
  go(number) {
    this.show(number);
    const step = `step=${this.number}`;
    history.replaceState(null, '', players.length > 1 ? `#${this.section.id}&${step}` : `#${step}`);
  }

  play() {
    const last = this.steps.length;
    if (this.number === last) this.go(1);
    this.timer = setInterval(() => {
      this.go(this.number + 1);
      if (this.number === last) this.stop();
    }, PLAY_MS);
    this.tell('\u23f8', 'Pause');
  }

  stop() {
    clearInterval(this.timer);
    this.timer = null;
    this.tell('\u25b6', 'Play');
  }

  tell(sign, label) {
    this.button.textContent = sign;
    this.button.setAttribute('aria-label', label);
  }
}

const players = [...document.querySelectorAll('.sequence')].map(section => new Player(section));

const follow = () => {
  const [, id, number] = /^#(?:(\w+)&)?step=(\d+)$/.exec(location.hash) || [];
  if (!number) return;
  players.filter(p => !id || p.section.id === id).forEach(p => {
    p.stop();
    p.show(number);
    if (id) p.section.scrollIntoView();
  });
};
window.addEventListener('hashchange', follow);
follow();

document.addEventListener('keydown', e => {
  const by = {ArrowLeft: -1, ArrowRight: 1}[e.key];
  if (!by || e.ctrlKey || e.altKey || e.metaKey) return;
  const section = e.target.closest('.sequence');
  const player = section ? players.find(p => p.section === section) : players[0];
  // The slider that has the focus moves by itself.
  if (!player || e.target === player.slider) return;
  e.preventDefault();
  player.stop();
  player.go(player.number + by);
});
})();
