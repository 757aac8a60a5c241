/* SPDX-License-Identifier: Apache-2.0
 *
 * Preloaded into a process, this is a disk that takes nothing: as long as the file FAILING_DISK_SWITCH exists, each
 * write and each sync below the folder FAILING_DISK fails with EIO.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/uio.h>
#include <unistd.h>

static int fails(int file) {
  const char *folder = getenv("FAILING_DISK");
  const char *on = getenv("FAILING_DISK_SWITCH");
  char link[64], path[4096];
  if (!folder || !on || access(on, F_OK) != 0) return 0;
  snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  const ssize_t length = readlink(link, path, sizeof path);
  if (length < (ssize_t)strlen(folder) || strncmp(path, folder, strlen(folder)) != 0) return 0;
  errno = EIO;
  return 1;
}

#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

ssize_t write(int file, const void *data, size_t size) { return fails(file) ? -1 : NEXT(write)(file, data, size); }

ssize_t writev(int file, const struct iovec *parts, int count) {
  return fails(file) ? -1 : NEXT(writev)(file, parts, count);
}

ssize_t pwrite(int file, const void *data, size_t size, off_t at) {
  return fails(file) ? -1 : NEXT(pwrite)(file, data, size, at);
}

ssize_t pwrite64(int file, const void *data, size_t size, off64_t at) {
  return fails(file) ? -1 : NEXT(pwrite64)(file, data, size, at);
}

int fsync(int file) { return fails(file) ? -1 : NEXT(fsync)(file); }

int fdatasync(int file) { return fails(file) ? -1 : NEXT(fdatasync)(file); }

size_t fwrite(const void *data, size_t size, size_t count, FILE *file) {
  return fails(fileno(file)) ? 0 : NEXT(fwrite)(data, size, count, file);
}

int fflush(FILE *file) { return file && fails(fileno(file)) ? EOF : NEXT(fflush)(file); }
