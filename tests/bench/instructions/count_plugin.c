/* A plugin of QEMU's: how many instructions each function of the emulated program executes. Written
 * at the end, a line each, to the file that the argument out= names: `COUNT SYMBOL`, `?` where a
 * block has no symbol (shared libraries).
 *
 * Built by scripts/instructions with the host's compiler; Debian ships no header of the interface,
 * so what is used of it (qemu-plugin.h, version 1) is declared here. */
#include <inttypes.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPORT __attribute__((visibility("default")))

typedef uint64_t plugin_id;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
typedef struct qemu_info qemu_info;

extern void qemu_plugin_register_vcpu_tb_trans_cb(plugin_id id,
                                                  void (*seen)(plugin_id, struct qemu_plugin_tb*));
extern void qemu_plugin_register_vcpu_tb_exec_inline(struct qemu_plugin_tb* block, int operation,
                                                     void* counter, uint64_t add);
extern void qemu_plugin_register_atexit_cb(plugin_id id, void (*at_end)(plugin_id, void*),
                                           void* data);
extern size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb* block);
extern struct qemu_plugin_insn* qemu_plugin_tb_get_insn(const struct qemu_plugin_tb* block,
                                                        size_t index);
extern const char* qemu_plugin_insn_symbol(const struct qemu_plugin_insn* instruction);

EXPORT int qemu_plugin_version = 1;

enum { kSlots = 1 << 16, kAdd = 0 };

struct function {
  char* name;
  uint64_t executed;
};

static struct function
    functions[kSlots]; /* by a hash of the name, open addressing; never full: a program has fewer */
static const char* out_file = "instructions.txt";
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

static struct function* function_named(const char* name) {
  uint32_t hash = 2166136261U;
  for (const char* c = name; *c != 0; ++c) hash = (hash ^ (unsigned char)*c) * 16777619U;
  for (uint32_t i = hash;; ++i) {
    struct function* f = &functions[i % kSlots];
    if (f->name == NULL) f->name = strdup(name);
    if (strcmp(f->name, name) == 0) return f;
  }
}

/* Called when a block is translated; what it adds is executed with the block. Threads of the
 * program lose some of each other's additions: count with one thread. */
static void block_translated(plugin_id id, struct qemu_plugin_tb* block) {
  (void)id;
  const char* symbol = qemu_plugin_insn_symbol(qemu_plugin_tb_get_insn(block, 0));
  pthread_mutex_lock(&lock);
  struct function* f = function_named(symbol == NULL ? "?" : symbol);
  pthread_mutex_unlock(&lock);
  qemu_plugin_register_vcpu_tb_exec_inline(block, kAdd, &f->executed,
                                           qemu_plugin_tb_n_insns(block));
}

static void write_counts(plugin_id id, void* data) {
  (void)id;
  (void)data;
  FILE* out = fopen(out_file, "w");
  if (out == NULL) return;
  for (size_t i = 0; i < kSlots; ++i)
    if (functions[i].name != NULL)
      fprintf(out, "%" PRIu64 " %s\n", functions[i].executed, functions[i].name);
  fclose(out);
}

EXPORT int qemu_plugin_install(plugin_id id, const qemu_info* info, int count, char** arguments) {
  (void)info;
  for (int i = 0; i < count; ++i)
    if (strncmp(arguments[i], "out=", 4) == 0) out_file = strdup(arguments[i] + 4);
  qemu_plugin_register_vcpu_tb_trans_cb(id, block_translated);
  qemu_plugin_register_atexit_cb(id, write_counts, NULL);
  return 0;
}
