// SPDX-License-Identifier: Apache-2.0
import { defineConfig } from "vitest/config";

// Flat names without hashes: map_builder serves the files from a table and tells browsers to ask each time.
const names = { entryFileNames: "[name].js", chunkFileNames: "[name].js", assetFileNames: "[name][extname]" };

export default defineConfig({
  base: "./",
  publicDir: false,
  build: {
    target: "es2023",
    // Everything is a file of its own: the page's Content-Security-Policy allows nothing inline.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1500,
    rollupOptions: { input: { view: "index.html" }, output: names },
  },
  worker: { format: "es", rollupOptions: { output: names } },
  test: { include: ["test/**/*.test.ts"], environment: "node" },
});
