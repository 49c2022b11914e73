"""What pages in a browser on this machine share: who may ask, files, the server, the 3D view."""
