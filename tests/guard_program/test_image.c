/* A compiled configuration in its file: what is read is what was compiled, and a file of which one bit, or the length, is
 * not as it was written is refused, whichever it is. */
#define _GNU_SOURCE /* mkdtemp */
#include "image.h"
#include "rig.h"

#include "unity.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char text[] =
    "format = 1; revision = 7; profile = \"trio-mp245a\"; firmware = \"3.12\";\n"
    "external_switch5_on = true; external_switch6_on = false; margin_um = 51.25;\n"
    "drives = ( { number = 1; device = \"MP-845\"; microstep_um = 0.09375;\n"
    "  box_um = { x = (100, 24900); y = (100, 24900); z = (100, 20000); };\n"
    "  surface = { retract = \"-z\"; at_um = 8000; clearance_um = 500; approach = (707, 0, 707); }; } );\n"
    "keepouts = ( { name = \"objective\"; drive = 1; exit = \"-z\";\n"
    "    box_um = { x = (9000, 16000); y = (9000, 16000); z = (17000, 25000); }; },\n"
    "  { name = \"bath\"; drive = 1; half = { normal = (0, 0, -1); through_um = (0, 0, 19000); }; } );\n";

static char directory[] = "/tmp/dryrig-image-XXXXXX", text_path[64], path[64];
static char why[RIG_WHY_MAX];
static rig compiled, read_back;
static uint8_t image[DR_LIMITS_IMAGE_BYTES];

static void put_file(const char *to, const void *bytes, size_t size)
{
    FILE *const file = fopen(to, "w");
    TEST_ASSERT_NOT_NULL(file);
    TEST_ASSERT_EQUAL_UINT(size, fwrite(bytes, 1, size, file));
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
}

static size_t get_file(const char *from, uint8_t *bytes, size_t room)
{
    FILE *const file = fopen(from, "r");
    TEST_ASSERT_NOT_NULL(file);
    const size_t size = fread(bytes, 1, room, file);
    (void)fclose(file);
    return size;
}

void setUp(void)
{
    put_file(text_path, text, sizeof text - 1);
    TEST_ASSERT_TRUE_MESSAGE(rig_read(&compiled, text_path, why, sizeof why), why);
    TEST_ASSERT_EQUAL_MESSAGE(IMAGE_WRITTEN, image_write(path, &compiled.limits, why, sizeof why), why);
    TEST_ASSERT_EQUAL_UINT(sizeof image, get_file(path, image, sizeof image));
}
void tearDown(void) { (void)unlink(path); }

static void what_is_read_is_what_was_compiled(void)
{
    uint8_t again[DR_LIMITS_IMAGE_BYTES + 1u];
    TEST_ASSERT_TRUE_MESSAGE(rig_read(&read_back, path, why, sizeof why), why);
    dr_limits_put(&read_back.limits, again);
    TEST_ASSERT_EQUAL_MEMORY(image, again, sizeof image);
    TEST_ASSERT_EQUAL_UINT32(dr_limits_crc(&compiled.limits), dr_limits_crc(&read_back.limits));
    TEST_ASSERT_EQUAL_STRING("obstacle 2", read_back.names[1]);
    TEST_ASSERT_EQUAL_UINT(sizeof image, get_file(path, again, sizeof again)); /* and nothing behind it */
    TEST_ASSERT_EQUAL_MEMORY("DRLM", image, 4);                                /* little-endian, CRC-32C at the end */
    TEST_ASSERT_EQUAL_HEX32(dr_crc32c(0, image, sizeof image - 4u),
                            (uint32_t)image[sizeof image - 4u] | (uint32_t)image[sizeof image - 3u] << 8 |
                                (uint32_t)image[sizeof image - 2u] << 16 | (uint32_t)image[sizeof image - 1u] << 24);
}

static void is_refused(const char *message)
{
    why[0] = '\0';
    TEST_ASSERT_FALSE_MESSAGE(rig_read(&read_back, path, why, sizeof why), message);
    TEST_ASSERT_EQUAL_STRING_LEN(path, why, strlen(path));
    TEST_ASSERT_GREATER_THAN(strlen(path) + 2u, strlen(why));
}

/* In the file itself, which is not written anew each time: some file systems make that slow. */
static void put_byte(int fd, size_t at, uint8_t byte)
{
    TEST_ASSERT_EQUAL_INT(1, (int)pwrite(fd, &byte, 1, (off_t)at));
}

static void every_flipped_bit_is_refused(void)
{
    char message[64];
    const int fd = open(path, O_WRONLY);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, fd);
    for (size_t at = 0; at < sizeof image; at++) {
        for (unsigned bit = 0; bit < 8; bit++) {
            (void)snprintf(message, sizeof message, "bit %u of byte %u", bit, (unsigned)at);
            put_byte(fd, at, (uint8_t)(image[at] ^ 1u << bit));
            is_refused(message);
        }
        put_byte(fd, at, image[at]);
    }
    (void)close(fd);
    TEST_ASSERT_TRUE(rig_read(&read_back, path, why, sizeof why));
}

static void every_truncation_is_refused_and_what_is_longer(void)
{
    char message[64];
    for (size_t size = sizeof image + 1; size-- > 0;) {
        if (size == sizeof image)
            continue;
        (void)snprintf(message, sizeof message, "%u bytes", (unsigned)size);
        TEST_ASSERT_EQUAL_INT(0, truncate(path, (off_t)size));
        is_refused(message);
    }
    put_file(path, image, sizeof image);
    TEST_ASSERT_EQUAL_INT(0, truncate(path, (off_t)sizeof image + 1)); /* a byte too many */
    is_refused("a byte too many");
}

/* Of two that are good, the one with the higher revision wins: they must not be mistaken for each other. */
static void only_a_higher_revision_replaces_another_content(void)
{
    dr_limits other = compiled.limits;
    uint8_t now[DR_LIMITS_IMAGE_BYTES];
    TEST_ASSERT_EQUAL(IMAGE_WRITTEN, image_write(path, &compiled.limits, why, sizeof why)); /* the same once more */
    other.margin_q++;
    TEST_ASSERT_EQUAL(IMAGE_NOT_NEWER, image_write(path, &other, why, sizeof why));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(why, "holds revision 7 of another configuration"), why);
    TEST_ASSERT_EQUAL_UINT(sizeof now, get_file(path, now, sizeof now));
    TEST_ASSERT_EQUAL_MEMORY(image, now, sizeof now);
    other.revision = 6;
    TEST_ASSERT_EQUAL(IMAGE_NOT_NEWER, image_write(path, &other, why, sizeof why));
    other.revision = 8;
    TEST_ASSERT_EQUAL_MESSAGE(IMAGE_WRITTEN, image_write(path, &other, why, sizeof why), why);
    TEST_ASSERT_TRUE(rig_read(&read_back, path, why, sizeof why));
    TEST_ASSERT_EQUAL_UINT32(8, read_back.limits.revision);
    put_file(path, image, sizeof image - 1u); /* a damaged one holds no revision */
    TEST_ASSERT_EQUAL(IMAGE_WRITTEN, image_write(path, &compiled.limits, why, sizeof why));
}

static void what_cannot_be_written_leaves_nothing_behind(void)
{
    char elsewhere[128];
    TEST_ASSERT_EQUAL(IMAGE_CANNOT, image_write("/dev/full", &compiled.limits, why, sizeof why));
    TEST_ASSERT_EQUAL_STRING("/dev/full: is no file; it stays", why);
    TEST_ASSERT_EQUAL(IMAGE_CANNOT, image_write(directory, &compiled.limits, why, sizeof why));
    (void)snprintf(elsewhere, sizeof elsewhere, "%s/none/rig.bin", directory);
    TEST_ASSERT_EQUAL(IMAGE_CANNOT, image_write(elsewhere, &compiled.limits, why, sizeof why));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(why, "No such file"), why);
    struct stat is;
    TEST_ASSERT_EQUAL_INT(0, stat(path, &is));
    TEST_ASSERT_EQUAL_HEX(0644, is.st_mode & 0777u);
    (void)unlink(path);
    (void)unlink(text_path);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, rmdir(directory), "something was left in it");
    TEST_ASSERT_EQUAL_INT(0, mkdir(directory, 0700));
}

int main(void)
{
    if (mkdtemp(directory) == NULL)
        return 1;
    (void)snprintf(text_path, sizeof text_path, "%s/rig.conf", directory);
    (void)snprintf(path, sizeof path, "%s/rig.bin", directory);
    UNITY_BEGIN();
    RUN_TEST(what_is_read_is_what_was_compiled);
    RUN_TEST(every_flipped_bit_is_refused);
    RUN_TEST(every_truncation_is_refused_and_what_is_longer);
    RUN_TEST(only_a_higher_revision_replaces_another_content);
    RUN_TEST(what_cannot_be_written_leaves_nothing_behind);
    (void)unlink(text_path);
    (void)unlink(path);
    (void)rmdir(directory);
    return UNITY_END();
}
