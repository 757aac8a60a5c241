// SPDX-License-Identifier: Apache-2.0
// The WebSocket: connects, connects again with growing pauses, and gives up a connection on which nothing comes.

import { PROTOCOL, type ClientText } from "./protocol";

const FIRST_PAUSE_MS = 500;
/** A server that is back is found within two seconds, however long it was gone. */
const LONGEST_PAUSE_MS = 1500;
/** The server sends a status text ten times a second: a connection silent for so long is dead. */
const SILENCE_MS = 6000;

export interface ConnectionEvents {
  opened(): void;
  /** The connection is gone; the next attempt follows after `retryMs`. */
  closed(attempt: number, retryMs: number): void;
  text(text: string): void;
  binary(buffer: ArrayBuffer): void;
}

export class Connection {
  private socket: WebSocket | null = null;
  private attempt = 0;
  private lastHeard = 0;
  private retryTimer: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly url: string, private readonly events: ConnectionEvents) {
    setInterval(() => this.watch(), 1000);
    this.connect();
  }

  send(message: ClientText): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  /** Tries at once instead of waiting for the next attempt. */
  retryNow(): void {
    if (this.socket === null) this.connect();
  }

  private connect(): void {
    clearTimeout(this.retryTimer);
    const socket = new WebSocket(this.url, PROTOCOL);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.lastHeard = performance.now();
    socket.onopen = () => {
      this.attempt = 0;
      this.lastHeard = performance.now();
      this.events.opened();
    };
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      this.lastHeard = performance.now();
      if (typeof data === "string") this.events.text(data);
      else this.events.binary(data);
    };
    socket.onclose = () => this.lose(socket);
  }

  private lose(socket: WebSocket): void {
    if (socket !== this.socket) return;
    this.socket = null;
    const pause = pauseBefore(++this.attempt);
    this.events.closed(this.attempt, pause);
    this.retryTimer = setTimeout(() => this.connect(), pause);
  }

  private watch(): void {
    if (!this.socket || performance.now() - this.lastHeard < SILENCE_MS) return;
    const silent = this.socket;
    silent.close();
    this.lose(silent); // the closing handshake of a dead peer takes minutes
  }
}

/** Milliseconds to wait before attempt 1, 2, ... */
export function pauseBefore(attempt: number): number {
  return Math.min(LONGEST_PAUSE_MS, FIRST_PAUSE_MS * 2 ** (attempt - 1));
}
