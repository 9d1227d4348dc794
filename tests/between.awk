# A text in which the lines of a file stand between the two lines that hold its markers.
#   awk -v begin=MARKER -v end=MARKER -v file=FILE -f tests/between.awk TEXT     status 1 unless each marker is there once
index($0, end) { inside = 0; ends++ }
!inside
index($0, begin) {
    inside = 1
    begins++
    while ((getline line < file) > 0) print line
}
END { exit begins != 1 || ends != 1 }
