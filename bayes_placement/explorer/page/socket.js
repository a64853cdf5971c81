// The socket: frames of a JSON header and arrays of single precision; it comes back by itself.

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

export class Link {
  /** `hear` is called with each header; `stands` with whether the server answers. */
  constructor(hear, stands) {
    this.hear = hear;
    this.stands = stands;
    this.pending = null; // the newest preview, while one is on its way
    this.serial = 0;
    this.onItsWay = 0;
    this.open();
  }

  open() {
    const address = new URL("socket", location.href);
    address.protocol = "ws:";
    this.web = new WebSocket(address);
    this.web.binaryType = "arraybuffer";
    this.web.onopen = () => this.stands(true);
    this.web.onmessage = (event) => this.take(unpacked(event.data));
    this.web.onclose = () => {
      this.stands(false);
      this.onItsWay = 0;
      setTimeout(() => this.open(), AGAIN);
    };
  }

  take(header) {
    this.hear(header);
    if (header.is === "curves" && header.serial && header.serial >= this.onItsWay) {
      this.onItsWay = 0;
      if (this.pending) this.preview(this.pending);
    }
  }

  send(message) {
    if (this.web.readyState !== WebSocket.OPEN) return;
    this.pending = null;
    this.web.send(JSON.stringify(message));
  }

  /** Send a move, or keep it until the one before is answered: only the newest counts. */
  preview(message) {
    if (this.onItsWay) {
      this.pending = message;
      return;
    }
    this.serial += 1;
    this.onItsWay = this.serial;
    this.send({ ...message, serial: this.serial });
  }
}
