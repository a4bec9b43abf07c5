// SPDX-License-Identifier: GPL-2.0 OR MIT
/*
 * A virtual IEEE 1394 card. To the kernel's FireWire core it is a link-layer controller like any
 * other, so /dev/fw*, sysfs, udev events, bus resets, transactions and isochronous reception are
 * the real ones. The remote nodes are played by a user program through /dev/vbus1394
 * (vergence_1394_abi.h).
 *
 * Cycle time follows CLOCK_MONOTONIC: second = ns / 1e9 mod 128, cycle = (ns mod 1e9) / 125 us,
 * with the drift and the offset of the parameters (vergence_1394.drift_ppb=50000
 * vergence_1394.offset_s=120 on the kernel's command line). Not emulated: isochronous transmission,
 * multichannel reception, requests from remote nodes to the host.
 */
#include <linux/dma-mapping.h>
#include <linux/ktime.h>
#include <linux/module.h>

#include "vergence_1394_card.h"

#define VB_GUID 0x00000000deb1394aULL

struct vcard* vcard_only;

static int drift_ppb;
module_param(drift_ppb, int, 0444);
MODULE_PARM_DESC(drift_ppb, "how much faster than CLOCK_MONOTONIC the bus clock runs");
static int offset_s;
module_param(offset_s, int, 0444);
MODULE_PARM_DESC(offset_s, "bus time at CLOCK_MONOTONIC zero, in seconds");

static u64 bus_ns(void) {
  u64 ns = ktime_get_ns();

  return ns + div_s64((s64)ns * drift_ppb, NSEC_PER_SEC) + (u64)offset_s * NSEC_PER_SEC;
}

u32 vcard_cycle_time(void) {
  u64 ns = bus_ns();
  u32 rest = do_div(ns, NSEC_PER_SEC);
  u32 seconds = ns & 0x7f;

  return seconds << 25 | (rest / 125000) << 12 | ((rest % 125000) * 3072) / 125000;
}

/* ---- bus resets ---- */

static u32 self_id(u32 id, u32 gap, u32 speed, bool contender, u32 p0, u32 p1, u32 p2) {
  return 2u << 30 | id << 24 | 1u << 22 | gap << 16 | speed << 14 | (contender ? 1u << 11 : 0) |
         4u << 8 | p0 << 6 | p1 << 4 | p2 << 2;
}

static void reset_work(struct work_struct* work) {
  struct vcard* v = container_of(work, struct vcard, reset_work);
  u32 ids[VB_MAX_NODES + 1], port[VB_MAX_NODES], count, i;
  struct vpending *p, *next;
  LIST_HEAD(stale);
  int generation;

  spin_lock_irq(&v->lock);
  count = v->node_count;
  v->generation = (v->generation + 1) & 0xff;
  generation = v->generation;
  v->bus_manager_id = 0x3f;
  v->bandwidth = BANDWIDTH_AVAILABLE_INITIAL;
  v->channels_hi = 0xffffffff;
  v->channels_lo = 0xffffffff;
  list_splice_init(&v->pending,
                   &stale); /* split transactions die with the reset; the core times them out */
  v->pending_count = 0;
  for (i = 0; i < count; i++) ids[i] = self_id(i, v->gap_count, v->speed, false, 2, 0, 0);
  for (i = 0; i < VB_MAX_NODES; i++) port[i] = i < count ? 3 : 1;
  ids[count] =
      self_id(count, v->gap_count, 3, true, port[0], port[1], port[2]); /* the card itself: S800 */
  v->reset_to_report = true;
  spin_unlock_irq(&v->lock);

  list_for_each_entry_safe(p, next, &stale, link) {
    kfree(p->record);
    kfree(p);
  }
  fw_core_handle_bus_reset(&v->card, LOCAL_BUS | count, generation, count + 1, ids, false);
  wake_up_interruptible(&v->wait);
}

/* ---- the rest of the card ---- */

static int vcard_set_rom(struct fw_card* card, const __be32* rom, size_t quadlets) {
  struct vcard* v = to_vcard(card);

  memset(v->rom, 0, sizeof(v->rom));
  memcpy(v->rom, rom, min_t(size_t, quadlets * 4, VB_ROM_BYTES));
  schedule_work(&v->reset_work);
  return 0;
}

static int vcard_read_phy(struct fw_card* card, int address) { return 0; }

static int vcard_update_phy(struct fw_card* card, int address, int clear, int set) {
  if ((address == 1 && (set & PHY_BUS_RESET)) || (address == 5 && (set & PHY_BUS_SHORT_RESET)))
    schedule_work(&to_vcard(card)->reset_work);
  return 0;
}

static int vcard_enable_dma(struct fw_card* card, int node_id, int generation) { return -ENODEV; }

static u32 vcard_read_csr(struct fw_card* card, int offset) {
  struct vcard* v = to_vcard(card);
  u64 ns;

  switch (offset) {
    case CSR_STATE_CLEAR:
    case CSR_STATE_SET:
      return CSR_STATE_BIT_CMSTR;
    case CSR_NODE_IDS:
      return (LOCAL_BUS | v->node_count) << 16;
    case CSR_CYCLE_TIME:
      return vcard_cycle_time();
    case CSR_BUS_TIME:
      ns = bus_ns();
      do_div(ns, NSEC_PER_SEC);
      return (u32)ns;
    default:
      return 0;
  }
}

static void vcard_write_csr(struct fw_card* card, int offset, u32 value) {}

static const struct fw_card_driver vcard_driver = {
    .enable = vcard_set_rom,
    .read_phy_reg = vcard_read_phy,
    .update_phy_reg = vcard_update_phy,
    .set_config_rom = vcard_set_rom,
    .send_request = vcard_send_request,
    .send_response = vcard_send_response,
    .cancel_packet = vcard_cancel_packet,
    .enable_phys_dma = vcard_enable_dma,
    .read_csr = vcard_read_csr,
    .write_csr = vcard_write_csr,
    .allocate_iso_context = vcard_allocate_iso,
    .free_iso_context = vcard_free_iso,
    .start_iso = vcard_start_iso,
    .set_iso_channels = vcard_set_iso_channels,
    .queue_iso = vcard_queue_iso,
    .flush_queue_iso = vcard_flush_queue,
    .flush_iso_completions = vcard_flush_completions,
    .stop_iso = vcard_stop_iso,
};

/* ---- start and end ---- */

static int __init vb_init(void) {
  struct vcard* v = kzalloc(sizeof(*v), GFP_KERNEL);
  int err;

  if (!v) return -ENOMEM;
  v->pdev = platform_device_register_simple("vergence1394", -1, NULL, 0);
  if (IS_ERR(v->pdev)) {
    err = PTR_ERR(v->pdev);
    goto fail_free;
  }
  err = dma_coerce_mask_and_coherent(&v->pdev->dev, DMA_BIT_MASK(64));
  if (err) goto fail_device;
  spin_lock_init(&v->lock);
  mutex_init(&v->write_mutex);
  INIT_LIST_HEAD(&v->pending);
  INIT_LIST_HEAD(&v->contexts);
  init_waitqueue_head(&v->wait);
  INIT_WORK(&v->reset_work, reset_work);
  v->speed = SCODE_400;
  v->gap_count = 5;
  v->bandwidth = BANDWIDTH_AVAILABLE_INITIAL;
  vcard_only = v;
  fw_card_initialize(&v->card, &vcard_driver, &v->pdev->dev);
  err = fw_card_add(&v->card, 10, SCODE_800, VB_GUID); /* 2^(10+1) bytes of payload */
  if (err) goto fail_device;
  err = misc_register(&vb_device);
  if (err) goto fail_card;
  return 0;
fail_card:
  fw_core_remove_card(&v->card);
  cancel_work_sync(&v->reset_work);
fail_device:
  platform_device_unregister(v->pdev);
fail_free:
  kfree(v);
  return err;
}

static void __exit vb_exit(void) {
  struct vcard* v = vcard_only;

  misc_deregister(&vb_device);
  fw_core_remove_card(&v->card);
  cancel_work_sync(&v->reset_work);
  platform_device_unregister(v->pdev);
  kfree(v);
}

/* After the FireWire core, also when built in. */
late_initcall(vb_init);
module_exit(vb_exit);

MODULE_DESCRIPTION("Virtual IEEE 1394 card; remote nodes live in a user program");
MODULE_LICENSE("Dual MIT/GPL");
