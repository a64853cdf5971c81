// How frames come and messages go: over a socket, through what holds the page, or kept within it.
// A frame is a JSON header and arrays of single precision.

const AGAIN = 1000; // [ms]

function unpacked(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let offset = 4 + length;
  for (const [name, shape] of header.arrays) {
    const size = shape.reduce((product, side) => product * side, 1);
    header[name] = new Float32Array(buffer, offset, size);
    header[name].shape = shape;
    offset += 4 * size;
  }
  return header;
}

/** `hear` is called with each header; `stands` with whether a program answers. */
export function linked(hear, stands) {
  const kept = document.getElementById("frames")?.textContent.trim();
  if (kept) return new Kept(kept, hear);
  return new Link(hear, stands, location.protocol === "about:" ? throughHolder : overSocket);
}

/** A socket that comes back by itself. */
function overSocket(link) {
  const address = new URL("socket", location.href);
  address.protocol = "ws:";
  const web = new WebSocket(address);
  web.binaryType = "arraybuffer";
  web.onopen = () => link.stands(true);
  web.onmessage = (event) => link.take(unpacked(event.data));
  web.onclose = () => {
    link.lost();
    setTimeout(() => link.open(), AGAIN);
  };
  return (text) => {
    const isOpen = web.readyState === WebSocket.OPEN;
    if (isOpen) web.send(text);
    return isOpen;
  };
}

/** Messages to the document that holds this one, a cell of a notebook. */
function throughHolder(link) {
  addEventListener("message", (event) => {
    if (event.source === parent && event.data instanceof ArrayBuffer) link.take(unpacked(event.data));
  });
  const send = (text) => parent.postMessage(text, "*");
  send("ready");
  return (text) => {
    send(text);
    return true;
  };
}

class Link {
  constructor(hear, stands, connect) {
    Object.assign(this, { hear, stands, connect });
    this.pending = null; // the newest preview, while one is on its way or nobody answers
    this.asked = null; // the one on its way
    this.serial = 0;
    this.onItsWay = 0;
    this.open();
  }

  open() {
    this.carry = this.connect(this);
  }

  /** A preview that was not answered is asked for again of the program that answers next. */
  lost() {
    this.stands(false);
    if (this.onItsWay) this.pending ??= this.asked;
    this.onItsWay = 0;
  }

  take(header) {
    this.hear(header);
    if (header.is === "error" || header.serial >= this.onItsWay) this.onItsWay = 0;
    if (this.pending && !this.onItsWay) this.preview(this.pending);
  }

  /** Send a message, after which no earlier preview counts; whether it went on its way. */
  send(message) {
    this.pending = this.asked = null;
    return this.carry(JSON.stringify(message));
  }

  /** Send a preview, or keep it until the one before is answered: only the newest counts. */
  preview(message) {
    if (this.onItsWay) {
      this.pending = message;
      return;
    }
    this.serial += 1;
    const isSent = this.send({ ...message, serial: this.serial });
    if (isSent) [this.asked, this.onItsWay] = [message, this.serial];
    else this.pending = message;
  }
}

/** Frames that the page holds: it can be looked at, and nothing can be changed. */
class Kept {
  constructor(text, hear) {
    this.hear = hear;
    document.body.classList.add("kept");
    this.read(text);
  }

  async read(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    const buffer = await new Response(stream).arrayBuffer();
    const headers = [];
    for (let at = 0; at < buffer.byteLength; ) {
      const length = new DataView(buffer).getUint32(at, true);
      headers.push(unpacked(buffer.slice(at + 4, at + 4 + length)));
      at += 4 + length;
    }
    this.modes = headers.find((header) => header.is === "modes");
    headers.filter((header) => header !== this.modes).forEach((header) => this.hear(header));
  }

  send(message) {
    if (message.do === "modes" && this.modes) this.hear(this.modes);
  }

  preview() {}
}
