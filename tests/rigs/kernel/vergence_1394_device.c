// SPDX-License-Identifier: GPL-2.0 OR MIT
/* /dev/vbus1394: the user program that plays the remote nodes (vergence_1394_abi.h). */
#include <linux/module.h>
#include <linux/uaccess.h>
#include <linux/vmalloc.h>

#include "vergence_1394_card.h"

#define VB_MAX_WRITE (4u << 20)

static int vb_open(struct inode* inode, struct file* file) {
  struct vcard* v = vcard_only;
  int err = 0;

  spin_lock_irq(&v->lock);
  if (v->opened)
    err = -EBUSY;
  else
    v->opened = true;
  spin_unlock_irq(&v->lock);
  file->private_data = v;
  return err ? err : nonseekable_open(inode, file);
}

static int vb_release(struct inode* inode, struct file* file) {
  struct vcard* v = file->private_data;

  spin_lock_irq(&v->lock);
  v->opened = false;
  v->node_count = 0; /* the program is gone: all its nodes are unplugged */
  spin_unlock_irq(&v->lock);
  schedule_work(&v->reset_work);
  return 0;
}

static struct vpending* first_unread(struct vcard* v) {
  struct vpending* p;

  list_for_each_entry(p, &v->pending, link) if (!p->handed_over) return p;
  return NULL;
}

static bool readable(struct vcard* v) {
  bool yes;

  spin_lock_irq(&v->lock);
  yes = v->reset_to_report || first_unread(v);
  spin_unlock_irq(&v->lock);
  return yes;
}

static ssize_t vb_read(struct file* file, char __user* to, size_t room, loff_t* pos) {
  struct vcard* v = file->private_data;
  u8 copy[sizeof(struct vb_request) + 512], *record = copy;
  size_t bytes = 0;
  struct vpending* p;
  ssize_t ret;

  while (!bytes) {
    if (!readable(v)) {
      if (file->f_flags & O_NONBLOCK) return -EAGAIN;
      if (wait_event_interruptible(v->wait, readable(v))) return -ERESTARTSYS;
    }
    spin_lock_irq(&v->lock);
    p = first_unread(v);
    if (v->reset_to_report) {
      struct vb_reset reset = {{VB_RESET, sizeof(reset)}, v->generation, v->node_count};

      bytes = sizeof(reset);
      memcpy(copy, &reset, bytes);
      v->reset_to_report = false;
    } else if (p) {
      bytes = p->record_bytes;
      record = bytes <= sizeof(copy) ? copy : kmalloc(bytes, GFP_ATOMIC);
      if (record) {
        memcpy(record, p->record, bytes);
        p->handed_over = true;
      }
    }
    spin_unlock_irq(&v->lock);
    if (!record) return -ENOMEM;
  }
  ret = bytes > room ? -EMSGSIZE : copy_to_user(to, record, bytes) ? -EFAULT : bytes;
  if (record != copy) kfree(record);
  return ret;
}

static __poll_t vb_poll(struct file* file, poll_table* table) {
  struct vcard* v = file->private_data;

  poll_wait(file, &v->wait, table);
  return EPOLLOUT | EPOLLWRNORM | (readable(v) ? EPOLLIN | EPOLLRDNORM : 0);
}

static int take_record(struct vcard* v, const u8* at, size_t length) {
  const struct vb_record* r = (const void*)at;

  if (r->type == VB_TOPOLOGY && length == sizeof(struct vb_topology)) {
    const struct vb_topology* t = (const void*)at;

    if (t->count > VB_MAX_NODES || t->speed > 3) return -EINVAL;
    spin_lock_irq(&v->lock);
    v->node_count = t->count;
    v->speed = t->speed;
    spin_unlock_irq(&v->lock);
    schedule_work(&v->reset_work);
    flush_work(&v->reset_work);
    return 0;
  }
  if (r->type == VB_RESPONSE && length >= sizeof(struct vb_response)) {
    vcard_take_response(v, (const void*)at, at + sizeof(struct vb_response),
                        length - sizeof(struct vb_response));
    return 0;
  }
  if (r->type == VB_ISO && length >= sizeof(struct vb_iso)) {
    const struct vb_iso* iso = (const void*)at;

    if (iso->channel > 63 || iso->tag > 3 || iso->sy > 15) return -EINVAL;
    vcard_take_iso(v, iso, at + sizeof(*iso), length - sizeof(*iso));
    return 0;
  }
  return -EINVAL;
}

static ssize_t vb_write(struct file* file, const char __user* from, size_t bytes, loff_t* pos) {
  struct vcard* v = file->private_data;
  size_t at = 0;
  int err = 0;
  u8* copy;

  if (bytes < sizeof(struct vb_record) || bytes > VB_MAX_WRITE) return -EINVAL;
  copy = kvmalloc(bytes, GFP_KERNEL);
  if (!copy) return -ENOMEM;
  if (copy_from_user(copy, from, bytes)) {
    kvfree(copy);
    return -EFAULT;
  }
  mutex_lock(&v->write_mutex);
  while (!err && at < bytes) {
    const struct vb_record* r = (const void*)(copy + at);

    if (bytes - at < sizeof(*r) || r->length < sizeof(*r) || r->length > bytes - at)
      err = -EINVAL;
    else
      err = take_record(v, copy + at, r->length);
    at += err ? 0 : ALIGN(r->length, 8);
  }
  mutex_unlock(&v->write_mutex);
  kvfree(copy);
  return err ? err : bytes;
}

static const struct file_operations vb_ops = {
    .owner = THIS_MODULE,
    .open = vb_open,
    .release = vb_release,
    .read = vb_read,
    .write = vb_write,
    .poll = vb_poll,
    .llseek = no_llseek,
};

struct miscdevice vb_device = {
    .minor = MISC_DYNAMIC_MINOR,
    .name = "vbus1394",
    .fops = &vb_ops,
};
