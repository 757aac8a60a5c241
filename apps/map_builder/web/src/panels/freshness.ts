// SPDX-License-Identifier: Apache-2.0
// How far the picture may be trusted: is the server there, is the data new, does the vehicle know where it is?

import { type ProcessHealth } from "../stream/protocol";

export const STALE_AFTER_S = 2;

export interface Situation {
  connected: boolean;
  everConnected: boolean;
  /** Seconds until the next attempt, when not connected. */
  retryInS: number;
  attempt: number;
  /** Seconds since the newest pose was made; null before the first one. */
  dataAgeS: number | null;
  health: ProcessHealth[];
}

export type Quality = "good" | "warn" | "bad" | "idle";

export interface Verdict {
  link: "live" | "waiting" | "stale" | "gone";
  tracking: { text: string; quality: Quality };
  banner: { kind: "note" | "stale" | "gone" | "lost"; title: string; text: string } | null;
  isLost: boolean;
}

const ESTIMATOR = "lio_frontend";

export function qualityOf(state: string): Quality {
  const word = state.toUpperCase();
  if (word === "OK") return "good";
  if (word === "DEGRADED") return "warn";
  return word === "LOST" || word === "FAULT" || word === "SILENT" || word === "GONE" ? "bad" : "idle";
}

export function judge(now: Situation): Verdict {
  const age = now.dataAgeS === null ? "" : `Newest data is ${seconds(now.dataAgeS)} old. `;
  if (!now.connected) {
    const next = now.retryInS > 0.05 ? `Trying again in ${seconds(now.retryInS)}` : "Trying";
    return {
      link: now.everConnected ? "gone" : "waiting",
      tracking: { text: now.everConnected ? "no server" : "connecting", quality: now.everConnected ? "bad" : "idle" },
      banner: now.everConnected || now.attempt > 0
        ? { kind: "gone", title: "map_builder does not answer", text: `${age}${next}, attempt ${now.attempt + 1}` }
        : null,
      isLost: false,
    };
  }
  if (now.dataAgeS === null) {
    return {
      link: "waiting",
      tracking: { text: "no data yet", quality: "idle" },
      banner: { kind: "note", title: "Waiting for the first pose", text: "Is lio_frontend running?" },
      isLost: false,
    };
  }
  if (now.dataAgeS > STALE_AFTER_S) {
    return {
      link: "stale",
      tracking: { text: "stale", quality: "warn" },
      banner: { kind: "stale", title: "Data is stale", text: `The newest pose is ${seconds(now.dataAgeS)} old` },
      isLost: false,
    };
  }
  const estimator = now.health.find(({ process }) => process === ESTIMATOR);
  const quality = estimator ? qualityOf(estimator.state) : "idle";
  if (estimator && quality === "bad") {
    const word = estimator.state.toUpperCase();
    return {
      link: "live",
      tracking: { text: word, quality: "bad" },
      banner: { kind: "lost", title: word === "LOST" ? "LOST: do not trust the pose" : `${ESTIMATOR}: ${word}`, text: estimator.reason },
      isLost: word === "LOST",
    };
  }
  return { link: "live", tracking: { text: quality === "warn" ? "degraded" : "tracking", quality: quality === "warn" ? "warn" : "good" }, banner: null, isLost: false };
}

function seconds(value: number): string {
  if (value < 10) return `${value.toFixed(1)} s`;
  return value < 120 ? `${value.toFixed(0)} s` : `${(value / 60).toFixed(0)} min`;
}
