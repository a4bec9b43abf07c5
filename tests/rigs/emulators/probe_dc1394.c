/* probe_dc1394 [FRAMES [fixed|format7 [trigger]]]: every camera libdc1394 finds, over IEEE 1394 or
 * USB, captured at once; checks the stamp of the emulators in row 0. Exits 0 if no frame was lost
 * or torn. Free running at half of what the cameras can: a kernel on one processor of a busy
 * machine keeps up with that. */
#include <dc1394/dc1394.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static uint64_t get(const uint8_t* p, int bytes) {
  uint64_t v = 0;
  for (int i = bytes; i--;) v = v << 8 | p[i];
  return v;
}

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int main(int argc, char** argv) {
  unsigned frames = argc > 1 ? (unsigned)atoi(argv[1]) : 30, bad = 0;
  int format7 = argc > 2 && !strcmp(argv[2], "format7"), trigger = argc > 3;
  dc1394_t* d = dc1394_new();
  dc1394camera_list_t* list = NULL;
  dc1394camera_t* cam[8];
  uint64_t exposure[8][4096];
  unsigned n;

  if (!d || dc1394_camera_enumerate(d, &list) || !list->num)
    return printf("probe_dc1394: no camera\n"), 1;
  n = list->num < 8 ? list->num : 8;
  for (unsigned i = 0; i < n; i++) {
    dc1394error_t e = 0;
    cam[i] = dc1394_camera_new(d, list->ids[i].guid);
    if (!cam[i]) return printf("camera %u does not open\n", i), 1;
    printf("camera %016llx %s / %s\n", (unsigned long long)cam[i]->guid, cam[i]->vendor,
           cam[i]->model);
    e |= dc1394_video_set_iso_speed(cam[i], DC1394_ISO_SPEED_400);
    if (format7) {
      e |= dc1394_video_set_mode(cam[i], DC1394_VIDEO_MODE_FORMAT7_0);
      e |= dc1394_format7_set_roi(cam[i], DC1394_VIDEO_MODE_FORMAT7_0, DC1394_COLOR_CODING_MONO8,
                                  512, 320, 240, 640, 480);
    } else {
      e |= dc1394_video_set_mode(cam[i], DC1394_VIDEO_MODE_640x480_MONO8);
      e |= dc1394_video_set_framerate(cam[i], trigger ? DC1394_FRAMERATE_30 : DC1394_FRAMERATE_15);
    }
    if (trigger) {
      e |= dc1394_external_trigger_set_mode(cam[i], DC1394_TRIGGER_MODE_0);
      e |= dc1394_external_trigger_set_power(cam[i], DC1394_ON);
    }
    e |= dc1394_feature_set_absolute_control(cam[i], DC1394_FEATURE_SHUTTER, DC1394_ON);
    e |= dc1394_feature_set_absolute_value(cam[i], DC1394_FEATURE_SHUTTER, 0.004f);
    if (e) return printf("set-up failed: %d\n", e), 1;
    if (dc1394_capture_setup(cam[i], 8, DC1394_CAPTURE_FLAGS_DEFAULT))
      return printf("capture set-up failed\n"), 1;
  }
  for (unsigned i = 0; i < n; i++)
    if (dc1394_video_set_transmission(cam[i], DC1394_ON)) return printf("transmission failed\n"), 1;
  double start = now(), late = 0;
  for (unsigned k = 0; k < frames; k++)
    for (unsigned i = 0; i < n; i++) {
      static uint64_t last[8];
      dc1394video_frame_t* f = NULL;
      if (dc1394_capture_dequeue(cam[i], DC1394_CAPTURE_POLICY_WAIT, &f) || !f)
        return printf("dequeue failed\n"), 1;
      const uint8_t* s = f->image + 64;
      uint64_t number = get(s + 4, 4);
      unsigned rows_wrong = 0;
      for (unsigned y = 1; y < f->size[1]; y++)
        rows_wrong += f->image[y * f->size[0]] != ((y + number) & 255) ||
                      f->image[y * f->size[0] + f->size[0] - 1] != ((y + number) & 255);
      if (memcmp(s, "VRGF", 4) || get(s + 16, 8) != cam[i]->guid || rows_wrong ||
          dc1394_capture_is_frame_corrupt(cam[i], f)) {
        printf("camera %u frame %u: torn (%u rows)\n", i, k, rows_wrong);
        bad++;
      }
      if (k && number != last[i] + 1) {
        printf("camera %u: from frame %llu to %llu\n", i, (unsigned long long)last[i],
               (unsigned long long)number);
        bad++;
      }
      last[i] = number;
      exposure[i][k & 4095] = get(s + 8, 8);
      double age = now() - 1e-9 * (double)get(s + 8, 8);
      late = age > late ? age : late;
      dc1394_capture_enqueue(cam[i], f);
    }
  double took = now() - start;
  unsigned apart = 0;
  for (unsigned k = 0; n > 1 && k < frames && k < 4096; k++)
    apart += exposure[0][k] != exposure[1][k];
  for (unsigned i = 0; i < n; i++) {
    dc1394_video_set_transmission(cam[i], DC1394_OFF);
    dc1394_capture_stop(cam[i]);
    dc1394_camera_free(cam[i]);
  }
  printf(
      "probe_dc1394: %u cameras, %u frames each in %.2f s (%.1f Hz), bad %u, pairs with unequal "
      "exposure %u, greatest age %.1f ms\n",
      n, frames, took, frames / took, bad, apart, late * 1e3);
  dc1394_camera_free_list(list);
  dc1394_free(d);
  return bad != 0;
}
