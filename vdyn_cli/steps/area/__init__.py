"""Frontal area from a silhouette picture and the size of the box around it.

Area = silhouette pixels / box pixels x box area x ((D + d)/D)^2: the camera stands D in front of the box, the car's
widest section d behind it (d < 0: in front), so the car looks smaller than the box by D/(D + d). With the box around
the car and the whole picture as box this is the paper's 84.2 % of 2.60 m^2 = 2.19 m^2.

Pixels at the edge count by their share: a car's outline crosses some 2 000 pixels, and counting whole ones by a
threshold moves the area by a fraction of their number. The area includes the tires and excludes the mirrors (the
definition of the EPA's road-load forms), which have to be folded, cut out with ``exclude``, or masked.

Assumes a camera on the car's axis, at the height of the middle of the car, without lens distortion. The uncertainty
contains box size and corners, camera distance and depth, and the place of the edge within the picture's blur, but not
shadows under the car. Sources: SAE 2017-01-1574; Otsu, IEEE Trans. SMC 9 (1979) 62 for the threshold.
"""
