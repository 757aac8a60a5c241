// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it } from "vitest";
import { number } from "../src/dom";
import { judge, type Situation } from "../src/panels/freshness";
import { PositionTrace, clock } from "../src/panels/timeline";
import { viewRadius } from "../src/scene/camera_rig";
import { arcPoint } from "../src/scene/loop_arcs";
import { AGE_RAMP, HEIGHT_RAMP, INTENSITY_RAMP, RAMP_STEPS, ageFraction, rampColour, rgb } from "../src/scene/palette";
import { sane } from "../src/settings";
import { ViewReporter } from "../src/view_reporter";

describe("colours", () => {
  it("meet the ramp's ends and middle", () => {
    expect(rampColour(HEIGHT_RAMP, -1)).toEqual(HEIGHT_RAMP[0]);
    rampColour(HEIGHT_RAMP, 2).forEach((value, i) => expect(value).toBeCloseTo(HEIGHT_RAMP[RAMP_STEPS - 1][i]));
    rampColour(HEIGHT_RAMP, 0.1).forEach((value, i) => expect(value).toBeCloseTo((HEIGHT_RAMP[0][i] + HEIGHT_RAMP[1][i]) / 2));
    expect(rgb(0xff8000)).toEqual([1, 128 / 255, 0]);
  });

  it("grow steadily lighter with height and intensity, darker with age", () => {
    const lightness = (colour: number[]): number => 0.2126 * colour[0] + 0.7152 * colour[1] + 0.0722 * colour[2];
    for (const [ramp, sign] of [[HEIGHT_RAMP, 1], [INTENSITY_RAMP, 1], [AGE_RAMP, -1]] as const) {
      const steps = ramp.map(lightness);
      for (let i = 1; i < steps.length; i++) expect(sign * (steps[i] - steps[i - 1])).toBeGreaterThan(0);
      expect(ramp.length).toBe(RAMP_STEPS);
    }
  });

  it("tell seconds from minutes of age", () => {
    expect([ageFraction(0), ageFraction(600), ageFraction(1e6)]).toEqual([0, 1, 1]);
    expect(ageFraction(10)).toBeGreaterThan(0.3);
  });
});

describe("judge", () => {
  const fine: Situation = {
    connected: true, everConnected: true, retryInS: 0, attempt: 0, dataAgeS: 0.1,
    health: [{ process: "lio_frontend", state: "OK", reason: "" }],
  };
  it("is calm when all is well", () => {
    expect(judge(fine)).toMatchObject({ link: "live", banner: null, isLost: false, tracking: { quality: "good" } });
  });
  it("says when data is stale, and how old it is", () => {
    expect(judge({ ...fine, dataAgeS: 3.21 })).toMatchObject({ link: "stale", banner: { kind: "stale", text: "The newest pose is 3.2 s old" } });
  });
  it("says when the server is gone", () => {
    expect(judge({ ...fine, connected: false, attempt: 2, retryInS: 1.5 })).toMatchObject({
      link: "gone", banner: { kind: "gone", text: "Newest data is 0.1 s old. Trying again in 1.5 s, attempt 3" },
    });
    expect(judge({ ...fine, connected: false, everConnected: false })).toMatchObject({ link: "waiting", banner: null });
  });
  it("cries out when the pose is lost, whatever else is well", () => {
    const lost = judge({ ...fine, health: [{ process: "lio_frontend", state: "LOST", reason: "no matches" }] });
    expect(lost).toMatchObject({ isLost: true, banner: { kind: "lost", text: "no matches" }, tracking: { quality: "bad" } });
  });
  it("shows a degraded estimator as such", () => {
    expect(judge({ ...fine, health: [{ process: "lio_frontend", state: "DEGRADED", reason: "" }] }).tracking)
      .toEqual({ text: "degraded", quality: "warn" });
  });
});

describe("small things", () => {
  it("numbers have fixed digits and no negative zero", () => {
    expect([number(-1.25, 1, "°"), number(-0.001, 2), number(NaN, 1), number(null, 1)]).toEqual(["−1.3°", "0.00", "–", "–"]);
  });
  it("the trace finds where the vehicle was, and forgets when time runs backwards", () => {
    const trace = new PositionTrace();
    for (let s = 0; s < 10; s++) trace.add(s * 1e6, [s, 0, 0]);
    expect(trace.at(4.4e6)).toEqual([4, 0, 0]);
    expect(trace.at(60e6)).toBeNull();
    trace.add(0, [7, 0, 0]);
    expect(trace.at(9e6)).toBeNull();
  });
  it("an arc begins and ends at its keyframes and rises between them", () => {
    const arc = { from: [0, 1, 0] as [number, number, number], to: [4, 1, 0] as [number, number, number] };
    expect([arcPoint(arc, 0), arcPoint(arc, 1), arcPoint(arc, 0.5)]).toEqual([[0, 1, 0], [4, 1, 0], [2, 3, 0]]);
  });
  it("the view radius grows with distance, width and an aim beside the vehicle", () => {
    expect(viewRadius(20, 0.5, 1, 0)).toBe(17);
    expect(viewRadius(20, 0.5, 2, 0)).toBe(34);
    expect(viewRadius(20, 0.5, 1, 5)).toBe(22);
  });
  it("the reporter reports a changed radius once, not too often, and clamped", () => {
    const sent: number[] = [];
    const reporter = new ViewReporter((radius) => sent.push(radius));
    for (const [radius, now] of [[20, 0], [20.5, 500], [30, 600], [30, 700], [40, 800], [50, 900], [9e9, 2000]]) {
      reporter.update(radius, 150, now);
    }
    expect(sent).toEqual([20, 30, 50, 150]);
    reporter.forget();
    expect(reporter.update(40, 150, 2001)).toBe(40);
  });
  it("stored settings of another version are taken where they make sense", () => {
    expect(sane({ follow: "yes", bands: false, colour: "plaid", cut: null, theme: "light", junk: 1 }))
      .toEqual({ bands: false, cut: null, theme: "light" });
  });
  it("clocks read as minutes and seconds", () => {
    expect(clock(125e6, 0)).toBe("02:05");
  });
});
